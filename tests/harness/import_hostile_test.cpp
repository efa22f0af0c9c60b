// Files that nobody meant: cut off, changed byte by byte, huge, deep, with entities. Each is read
// or refused with a message, and never anything else.
#include <gtest/gtest.h>

#include <ctime>
#include <filesystem>
#include <random>
#include <set>

#include "harness/config/mechanism_reader.h"
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

/// A second for time in proportion to the size; where each part looks at all others it takes ten
/// and more.
void ExpectQuick(const std::string& text) {
  const std::clock_t begin = std::clock();
  ReadOrRefuse(text);
  EXPECT_LT(std::clock() - begin, 5 * CLOCKS_PER_SEC) << text.substr(0, 200);
}

TEST(ImportHostile, ManyPartsTakeTimeInProportion) {
  const auto repeat = [](int times, auto&& part) {
    std::string all;
    for (int i = 0; i < times; ++i) all += part(std::to_string(i), std::to_string(i + 1));
    return all;
  };
  const std::string inertial = "<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>";
  const auto mujoco = [&](const std::string& in_body, const std::string& in_joint = "",
                          const std::string& rest = "") {
    return "<mujoco><worldbody><site name=\"s\"/><body><joint " + in_joint + "/>" + inertial +
           in_body + "</body></worldbody>" + rest + "</mujoco>";
  };
  ExpectQuick(mujoco(repeat(
      50000, [](const std::string& i, const auto&) { return "<site name=\"s" + i + "\"/>"; })));
  ExpectQuick("<sdf version=\"1.9\"><model name=\"m\">" +
              repeat(10000,
                     [](const std::string& i, const std::string& next) {
                       return "<link name=\"l" + i + "\"><pose relative_to=\"l" + next +
                              "\">0 0 1 0 0 0</pose></link>";
                     }) +
              "<link name=\"l10000\"/></model></sdf>");
  // joints on frames that are attached to each other
  ExpectQuick("<sdf version=\"1.9\"><model name=\"m\"><link name=\"a\"/><frame name=\"f0\"/>" +
              repeat(10000,
                     [](const std::string& i, const std::string& next) {
                       return "<frame name=\"f" + next + "\" attached_to=\"f" + i +
                              "\"/><link name=\"l" + i + "\"/><joint name=\"j" + i +
                              "\" type=\"ball\"><parent>f" + next + "</parent><child>l" + i +
                              "</child></joint>";
                     }) +
              "</model></sdf>");
  // springs, each in a section of its own
  ExpectQuick(mujoco(repeat(10000,
                            [&](const std::string& i, const auto&) {
                              return "<body>" + inertial + "<joint/><site name=\"s" + i +
                                     "\"/></body>";
                            }),
                     "", repeat(10000, [](const std::string& i, const auto&) {
                       return "<tendon><spatial stiffness=\"1\"><site site=\"s\"/><site site=\"s" +
                              i + "\"/></spatial></tendon>";
                     })));
}

TEST(ImportHostile, ManyAttributesAndDefaultsAreRefused) {
  std::string attributes;
  for (int i = 0; i < 1000; ++i) attributes += " a" + std::to_string(i) + "='\"'";
  const auto joint = [&](const std::string& inside) {
    return "<!-- a=\"\" -->\n<mujoco><worldbody><body><joint" + inside + "/>" +
           "<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/></body></worldbody></mujoco>";
  };
  EXPECT_EQ(Refusal(joint(attributes)), "");
  ExpectRefusal(joint(attributes + " b=\"\""), {"file.xml:2", "1001 attributes", "at most 1000"});
  const auto defaults = [](int count) {
    return "<mujoco><default>" + Repeated("<joint/>", count) +
           "</default><worldbody><body><joint/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 "
           "1 1\"/>"
           "</body></worldbody></mujoco>";
  };
  EXPECT_EQ(Refusal(defaults(100)), "");
  ExpectRefusal(defaults(101), {"<joint>", "more than 100 defaults"});
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
