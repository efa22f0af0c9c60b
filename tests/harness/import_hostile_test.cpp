// Files that nobody meant: cut off, changed byte by byte, huge, deep, with entities. Each is read
// or refused with a message, and never anything else.
#include "harness/base/json_document.h"
#include "harness/config/mechanism_reader.h"
#include "tests/harness/import_texts.h"

namespace loopbench::harness::import_hostile_test {

namespace fs = std::filesystem;

const std::string kBodyStart = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";

/// Reads, writes, or refuses; a message is one of ours: it names the file and is not endless.
void ReadOrRefuse(const std::string& text) {
  try {
    const Imported imported = ImportOf(text);
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
  std::string robot = ReadFile(kConfigs / "imports/one-four-bar.urdf");
  texts.push_back(robot.insert(robot.find("<joint"), TestData("loops-inside.xml")));
  texts.push_back(TestData("replicas.xml"));
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
                          (text[at - 1] == '"' || text[at - 1] == '\'' || text[at - 1] == ' ' ||
                           text[at - 1] == '>');
      if (!starts || at % 3 != 0) continue;
      const std::size_t end = text.find_first_of(" \"'<", at);
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
  const std::string open = "<body><joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";
  const auto nested = [&](int depth) {
    return "<mujoco><worldbody>" + Repeated(open, depth) + Repeated("</body>", depth) +
           "</worldbody></mujoco>";
  };
  EXPECT_EQ(ImportOf(nested(90)).description.bodies.size(), 91u);
  ExpectRefusal(nested(100000), {"file.xml:", "elements within each other"});
  ExpectRefusal("<sdf version='1.9'>" + Repeated("<model name='m'>", 100000),
                {"elements within each other"});
}

TEST(ImportHostile, ManyFramesInARowAreResolved) {
  std::string frames = "<frame name='f0'/>";
  for (int i = 1; i < 3000; ++i) {
    const std::string before = std::to_string(i - 1);
    frames += "<frame name='f" + std::to_string(i) + "' attached_to='f" + before +
              "'><pose>1 0 0 0 0 0</pose></frame>";
  }
  const Imported imported =
      ImportOf("<sdf version='1.9'><model name='m'>" + frames +
               "<link name='a'><pose relative_to='f2999'/></link></model></sdf>");
  EXPECT_NEAR(imported.description.initial.coordinates[0].values[4], 2999.0, 1e-9);
}

/// Twice the parts take twice the time; where each part looks at all others, four times.
void ExpectProportional(int parts, const std::function<std::string(int)>& text) {
  const auto seconds = [&](int count) {
    const std::string whole = text(count);
    const std::clock_t begin = std::clock();
    ReadOrRefuse(whole);
    return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  const double half = seconds(parts / 2);
  EXPECT_LT(seconds(parts), 3.0 * half + 0.1) << text(2);
}

TEST(ImportHostile, ManyPartsTakeTimeInProportion) {
  // {0} is the number of the part, {1} the next one
  const auto repeat = [](int times, const std::string& part) {
    std::string all;
    for (int i = 0; i < times; ++i) all += fmt::format(fmt::runtime(part), i, i + 1);
    return all;
  };
  const std::string body = "<body>" + kBodyStart + "<joint/>";
  const auto mujoco = [&](const std::string& in_body, const std::string& rest = "") {
    return "<mujoco><worldbody><site name='s'/>" + body + in_body + "</body></worldbody>" + rest +
           "</mujoco>";
  };
  const auto sdf = [](const std::string& inside) {
    return "<sdf version='1.9'><model name='m'>" + inside + "</model></sdf>";
  };
  ExpectProportional(20000,
                     [&](int parts) { return mujoco(repeat(parts, "<site name='s{0}'/>")); });
  ExpectProportional(4000, [&](int parts) {
    return sdf(
        repeat(parts, "<link name='l{0}'><pose relative_to='l{1}'>0 0 1 0 0 0</pose></link>") +
        fmt::format("<link name='l{}'/>", parts));
  });
  // joints on frames that are attached to each other
  ExpectProportional(4000, [&](int parts) {
    return sdf(
        "<link name='a'/><frame name='f0'/>" +
        repeat(parts,
               "<frame name='f{1}' attached_to='f{0}'/><link name='l{0}'/><joint name='j{0}' "
               "type='ball'><parent>f{1}</parent><child>l{0}</child></joint>"));
  });
  // springs, each in a section of its own
  ExpectProportional(4000, [&](int parts) {
    return mujoco(repeat(parts, body + "<site name='s{0}'/></body>"),
                  repeat(parts,
                         "<tendon><spatial stiffness='1'><site site='s'/><site site='s{0}'/>"
                         "</spatial></tendon>"));
  });
}

TEST(ImportHostile, ManyAttributesAndDefaultsAreRefused) {
  std::string attributes;
  for (int i = 0; i < 1000; ++i) attributes += " a" + std::to_string(i) + "='\"'";
  const auto joint = [&](const std::string& inside) {
    return "<!-- a='' -->\n<mujoco><worldbody><body><joint" + inside + "/>" +
           "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body></worldbody></mujoco>";
  };
  EXPECT_EQ(Refusal(joint(attributes)), "");
  ExpectRefusal(joint(attributes + " b=''"), {"file.xml:2", "1001 attributes", "at most 1000"});
  const auto defaults = [](int count) {
    return "<mujoco><default>" + Repeated("<joint/>", count) +
           "</default><worldbody><body><joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 "
           "1'/></body></worldbody></mujoco>";
  };
  EXPECT_EQ(Refusal(defaults(100)), "");
  ExpectRefusal(defaults(101), {"<joint>", "more than 100 defaults"});
}

TEST(ImportHostile, EntitiesAndDocumentTypesAreRefused) {
  EXPECT_NE(Refusal("<!DOCTYPE m [<!ENTITY a 'aaaa'><!ENTITY b '&a;&a;'>]><mujoco>&b;</mujoco>"),
            "");
  ExpectRefusal("<mujoco>\xff</mujoco>", {"file.xml:1"});
  ExpectRefusal(std::string("<mujoco>\0</mujoco>", 18), {"file.xml:1"});
}

TEST(ImportHostile, NamesOfAnyLettersAreTextEverywhere) {
  const std::string robot =
      "<robot name='&lt;b&gt;&#10;&quot;x&quot;'><link name='world'/><link "
      "name='&lt;script&gt;&#27;[31m&apos;&quot;'><inertial><mass value='1'/><inertia ixx='1' "
      "iyy='1' izz='1'/></inertial></link><joint name='..&#10;/ ' type='continuous'><parent "
      "link='world'/><child link='&lt;script&gt;&#27;[31m&apos;&quot;'/></joint></robot>";
  const Imported imported = ImportOf(robot);
  EXPECT_EQ(imported.description.name, "<b>\n\"x\"");
  EXPECT_EQ(imported.description.bodies[1].name, "<script>\x1b[31m'\"");
  ExpectWords(MechanismText(imported.description, imported.observe), {"\\u001b"});
}

TEST(ImportHostile, HugeFilesAreRefusedUnread) {
  const fs::path file = fs::path(testing::TempDir()) / "loopbench-huge.xml";
  WriteFileAtomically(file, "<mujoco>" + std::string(kMaxConfigBytes, ' ') + "</mujoco>");
  EXPECT_THROW(ImportMechanism(file), ConfigError);
  fs::remove(file);
}

TEST(ImportHostile, ManyThingsWithoutNamesHaveShortOnes) {
  const std::string body = "<body><joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";
  const Imported imported =
      ImportOf("<mujoco><worldbody>" + body + "</body>" + body + "</body></worldbody><equality>" +
               Repeated("<connect body1='body1' body2='body2' anchor='0 0 0'/>", 3000) +
               "</equality></mujoco>");
  std::set<std::string> names;
  for (const JointDescription& joint : imported.description.joints) {
    names.insert(joint.name);
    EXPECT_LE(joint.name.size(), std::string("connect_3000").size());
  }
  EXPECT_EQ(names.size(), 3002u);
}

/// Beside the folder "model" is a file that is not below it.
class ImportIncludes : public ModelFolder {
 protected:
  ImportIncludes() {
    for (const char* secret : {"../secret.xml", "../model-2/secret.xml", "parts/none.txt"}) {
      Write(secret, "<x><worldbody/></x>");
    }
  }
  /// Expects this message where the main file includes `name` in its second line.
  void ExpectRefused(const std::string& name, std::vector<std::string> words) const {
    Write("main.xml", "<mujoco>\n<include file='" + name + "'/></mujoco>");
    words.push_back("model/main.xml:2: <include> file: found \"" + name + "\", expected ");
    ExpectMessage(words);
  }
};

TEST_F(ImportIncludes, ElementsOfIncludedFilesStandInPlace) {
  const auto main = [](const std::string& defaults, const std::string& arm) {
    return "<mujoco model='m'>" + defaults + "<worldbody><body name='a'><joint name='j'/>" +
           kBodyStart + arm + "<body name='z'><joint/>" + kBodyStart +
           "</body></body></worldbody></mujoco>";
  };
  const auto arm = [](const std::string& tip) {
    return "<body name='b'><joint name='k'/>" + kBodyStart + tip + "</body><site name='s'/>";
  };
  const std::string defaults = "<default><joint damping='2' axis='0 1 0'/></default>",
                    tip = "<body name='c' pos='1 0 0'><joint/>\n" + kBodyStart + "<geom/></body>";
  Write("main.xml", main("<include file='defaults.xml'/>", "<include file='parts/arm.xml'/>"));
  Write("defaults.xml", "\xEF\xBB\xBF<mujocoinclude>" + defaults + "</mujocoinclude>");
  Write("parts/arm.xml", "<mujoco>" + arm("<include file='tip.xml'/>") + "</mujoco>");
  Write("parts/tip.xml", "<x>" + tip + "</x>");  // beside the file that includes it
  const Imported parts = Read(), whole = ImportOf(main(defaults, arm(tip)));
  EXPECT_EQ(MechanismText(parts.description, parts.observe),
            MechanismText(whole.description, whole.observe));
  EXPECT_EQ(parts.description.bodies.size(), 5u);
  ASSERT_EQ(parts.notes.size(), 1u);
  EXPECT_EQ(parts.notes[0].file, (model_ / "parts/tip.xml").string());
  EXPECT_EQ(parts.notes[0].line, 2);
  EXPECT_EQ(parts.notes[0].element, "<geom>");
  // messages name the file and the line there
  Write("parts/tip.xml", "<x>\n<body name='c' pos='1 0'/></x>");
  ExpectMessage({"model/parts/tip.xml:2: <body name='c'> pos: found '1 0', expected 3 numbers"});
  Write("parts/tip.xml", "<x>\n<body></x>");
  ExpectMessage({"model/parts/tip.xml:2: found a fault of syntax"});
  // names from the folder of the main file come first
  Write("tip.xml", "<x/>");
  EXPECT_EQ(Read().description.bodies.size(), 4u);
}

TEST_F(ImportIncludes, FilesBelowTheFolderAreReadAndNoOthers) {
  const std::string expected = "a file below the folder of the main file";
  fs::create_symlink(folder_.path() / "secret.xml", model_ / "link.xml");
  fs::create_directory_symlink(folder_.path(), model_ / "up");
  for (const std::string& name :
       {std::string("../secret.xml"), std::string("../model-2/secret.xml"),
        std::string("parts/../../secret.xml"), std::string("link.xml"),
        std::string("up/secret.xml"), (folder_.path() / "secret.xml").string(),
        std::string("/dev/zero"), std::string("/etc/passwd")}) {
    ExpectRefused(name, {expected});
  }
  for (const std::string& name : {std::string("none.xml"), std::string("parts"), std::string("."),
                                  std::string("none/../main.xml"), std::string(5000, 'a')}) {
    Write("main.xml", "<mujoco>\n<include file='" + name + "'/></mujoco>");
    ExpectMessage({"model/main.xml:2: <include> file: found ", "a file that exists"});
  }
  ExpectRefused("", {"a name that is not empty"});
  Write("main.xml", "<mujoco>\n<include/></mujoco>");
  ExpectMessage({"model/main.xml:2: <include>: found no 'file'", expected});
  // a way out and back, and a link within the folder, stay below it
  Write("world.xml", "<x><worldbody><body><joint/>" + kBodyStart + "</body></worldbody></x>");
  fs::create_symlink("world.xml", model_ / "near.xml");
  for (const char* name : {"../model/world.xml", "near.xml", "parts/../world.xml"}) {
    Write("main.xml", "<mujoco><include file='" + std::string(name) + "'/></mujoco>");
    EXPECT_EQ(Read().description.bodies.size(), 2u);
  }
}

TEST_F(ImportIncludes, CyclesBombsAndHugeFilesAreRefused) {
  const auto include = [](const std::string& name, int times = 1) {
    return "<x>" + Repeated("\n<include file='" + name + "'/>", times) + "</x>";
  };
  ExpectRefused("main.xml", {"no cycle of files (main.xml > main.xml)"});
  Write("a.xml", include("parts/b.xml"));
  Write("parts/b.xml", include("main.xml"));
  Write("main.xml", "<mujoco><include file='a.xml'/></mujoco>");
  ExpectMessage({"model/parts/b.xml:2: <include> file: found 'main.xml'",
                 "no cycle of files (main.xml > a.xml > b.xml > main.xml)"});
  // each file twice in the one before
  for (int i = 0; i < 12; ++i) {
    Write("bomb" + std::to_string(i) + ".xml", include("bomb" + std::to_string(i + 1) + ".xml", 2));
  }
  Write("bomb12.xml", "<x/>");
  Write("main.xml", "<mujoco><include file='bomb0.xml'/></mujoco>");
  ExpectMessage({"model/bomb11.xml:3: <include> file: found 'bomb12.xml'", "each file once"});
  for (int i = 0; i < 17; ++i) {
    Write("deep" + std::to_string(i) + ".xml", include("deep" + std::to_string(i + 1) + ".xml"));
  }
  Write("main.xml", "<mujoco><include file='deep0.xml'/></mujoco>");
  ExpectMessage({"model/deep15.xml:2: <include> file: found 'deep16.xml'", "at most 16 nested"});
  Write("half.xml", "<x>" + std::string(kMaxConfigBytes / 2, ' ') + "</x>");
  Write("half2.xml", "<x>" + std::string(kMaxConfigBytes / 2, ' ') + "</x>");
  Write("main.xml", "<mujoco><include file='half.xml'/>\n<include file='half2.xml'/></mujoco>");
  ExpectMessage({"model/main.xml:2: <include> file: found 'half2.xml'", "16 MiB in all"});
}

}  // namespace loopbench::harness::import_hostile_test
