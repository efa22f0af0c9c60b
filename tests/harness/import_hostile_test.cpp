// Files that nobody meant: cut off, changed byte by byte, huge, deep, with entities. Each is read
// or refused with a message, and never anything else.
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <set>

#include "harness/config/mechanism_writer.h"
#include "harness/json/json_document.h"
#include "harness/text/files.h"
#include "tests/harness/import_texts.h"
#include "tests/harness/places.h"

namespace loopbench::harness {
namespace import_hostile_test {

namespace fs = std::filesystem;

/// Reads, writes, or refuses; a message is one of ours: it names the file and is not endless.
void ReadOrRefuse(const std::string& text) {
  try {
    const Imported imported = ImportText(text, "file.xml");
    MechanismText(imported.description, imported.observe);
  } catch (const ConfigError& error) {
    const std::string message = error.what();
    EXPECT_FALSE(message.empty());
    EXPECT_LT(message.size(), 20000u);
    EXPECT_TRUE(EncodingFault(message).empty()) << message;
  }
}

std::vector<std::string> Files() {
  std::vector<std::string> texts;
  for (const auto& entry : fs::directory_iterator(kConfigs / "imports")) {
    if (entry.path().extension() != ".json") texts.push_back(ReadFile(entry.path()));
  }
  return texts;
}

TEST(ImportHostile, FilesThatAreCutOffAreRefused) {
  for (const std::string& text : Files()) {
    const std::size_t end = text.find_last_of('>');
    for (std::size_t size = 0; size < end; size += 13) {
      EXPECT_NE(Refusal(text.substr(0, size)), "") << text.substr(0, size);
    }
  }
}

TEST(ImportHostile, FilesWithChangedBytesAreReadOrRefused) {
  std::mt19937 random(20240229);  // any number: the same files at every run
  const std::string bytes = "<>\"'&/= 0123456789.eE-+naif\n\t\x01\x80\xff";
  for (const std::string& text : Files()) {
    for (int i = 0; i < 150; ++i) {
      std::string changed = text;
      const std::size_t count = 1 + random() % 4;
      for (std::size_t k = 0; k < count; ++k) {
        changed[random() % changed.size()] = bytes[random() % bytes.size()];
      }
      ReadOrRefuse(changed);
    }
  }
}

TEST(ImportHostile, FilesWithPartsMovedAreReadOrRefused) {
  std::mt19937 random(7);
  for (const std::string& text : Files()) {
    for (int i = 0; i < 150; ++i) {
      const std::size_t from = random() % text.size(), size = random() % 200;
      const std::string part = text.substr(from, size);
      std::string changed = text;
      if (random() % 2 == 0) changed.erase(from, size);
      changed.insert(random() % changed.size(), part);
      ReadOrRefuse(changed);
    }
  }
}

/// Every number of a file by others that no file should have.
TEST(ImportHostile, NumbersThatAreNoneAreRefusedOrHarmless) {
  for (const std::string& text : Files()) {
    for (std::size_t at = text.find("-->"); at < text.size(); ++at) {
      const bool starts = std::isdigit(static_cast<unsigned char>(text[at])) != 0 &&
                          (text[at - 1] == '"' || text[at - 1] == ' ' || text[at - 1] == '>');
      if (!starts || at % 3 != 0) continue;
      const std::size_t end = text.find_first_of(" \"<", at);
      for (const char* number : {"nan", "1e999", "1e300", "-1e300", "0"}) {
        ReadOrRefuse(text.substr(0, at) + number + text.substr(end));
      }
    }
  }
}

std::string Repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

TEST(ImportHostile, DeepFilesAreRefusedByDepthOrRead) {
  const std::string open =
      "<body><joint/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>";
  const auto nested = [&](int depth) {
    return "<mujoco><worldbody>" + Repeated(open, depth) + Repeated("</body>", depth) +
           "</worldbody></mujoco>";
  };
  EXPECT_EQ(ImportText(nested(90), "file.xml").description.bodies.size(), 91u);
  ExpectRefusal(nested(100000), {"file.xml:", "elements within each other"});
  ExpectRefusal("<sdf version=\"1.9\">" + Repeated("<model name=\"m\">", 100000),
                {"elements within each other"});
}

TEST(ImportHostile, ManyFramesInARowAreResolved) {
  std::string frames = "<frame name=\"f0\"/>";
  for (int i = 1; i < 3000; ++i) {
    const std::string before = std::to_string(i - 1);
    frames += "<frame name=\"f" + std::to_string(i) + "\" attached_to=\"f" + before +
              "\"><pose>1 0 0 0 0 0</pose></frame>";
  }
  const Imported imported =
      ImportText("<sdf version=\"1.9\"><model name=\"m\">" + frames +
                     "<link name=\"a\"><pose relative_to=\"f2999\"/></link></model></sdf>",
                 "file.xml");
  EXPECT_NEAR(imported.description.initial.coordinates[0].values[4], 2999.0, 1e-9);
}

TEST(ImportHostile, EntitiesAndDocumentTypesAreRefused) {
  ExpectRefusal("<!DOCTYPE mujoco SYSTEM \"file:///etc/passwd\"><mujoco/>", {"document type"});
  EXPECT_NE(
      Refusal("<!DOCTYPE m [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\">]><mujoco>&b;</mujoco>"), "");
  ExpectRefusal("", {"file.xml:1", "well-formed XML"});
  ExpectRefusal("   ", {"file.xml:1"});
  ExpectRefusal("<mujoco><worldbody></mujoco>", {"file.xml:1", "fault of syntax"});
  ExpectRefusal("<mujoco>\xff</mujoco>", {"file.xml:1"});
  ExpectRefusal(std::string("<mujoco>\0</mujoco>", 18), {"file.xml:1"});
}

TEST(ImportHostile, NamesOfAnyLettersAreTextEverywhere) {
  const std::string robot =
      "<robot name=\"&lt;b&gt;&#10;&quot;x&quot;\"><link name=\"world\"/>"
      "<link name=\"&lt;script&gt;&#27;[31m&apos;&quot;\"><inertial><mass value=\"1\"/>"
      "<inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial></link>"
      "<joint name=\"..&#10;/ \" type=\"continuous\"><parent link=\"world\"/>"
      "<child link=\"&lt;script&gt;&#27;[31m&apos;&quot;\"/></joint></robot>";
  const Imported imported = ImportText(robot, "file.xml");
  EXPECT_EQ(imported.description.name, "<b>\n\"x\"");
  EXPECT_EQ(imported.description.bodies[1].name, "<script>\x1b[31m'\"");
  EXPECT_NE(MechanismText(imported.description, imported.observe).find("\\u001b"),
            std::string::npos);
  // a reference to half a character is no text
  ExpectRefusal("<robot name=\"&#xD800;\"><link name=\"a\"/></robot>", {"UTF-8"});
}

TEST(ImportHostile, HugeFilesAreRefusedUnread) {
  const fs::path file = fs::path(testing::TempDir()) / "loopbench-huge.xml";
  WriteFileAtomically(file, "<mujoco>" + std::string(kMaxConfigBytes, ' ') + "</mujoco>");
  EXPECT_THROW(ImportMechanism(file), ConfigError);
  fs::remove(file);
}

TEST(ImportHostile, ManyThingsWithoutNamesHaveShortOnes) {
  const std::string body =
      "<body><joint/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>";
  const Imported imported =
      ImportText("<mujoco><worldbody>" + body + "</body>" + body + "</body></worldbody><equality>" +
                     Repeated("<connect body1=\"body1\" body2=\"body2\" anchor=\"0 0 0\"/>", 3000) +
                     "</equality></mujoco>",
                 "file.xml");
  std::set<std::string> names;
  for (const JointDescription& joint : imported.description.joints) {
    names.insert(joint.name);
    EXPECT_LE(joint.name.size(), std::string("connect_3000").size());
  }
  EXPECT_EQ(names.size(), 3002u);
}

}  // namespace import_hostile_test
}  // namespace loopbench::harness
