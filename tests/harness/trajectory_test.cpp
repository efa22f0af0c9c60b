// Files of trajectories: labels, what is written and read back, what is refused, whole runs by the
// command line.
#include "harness/observers/trajectory.h"

#include <sys/resource.h>

#include "harness/config/experiment_reader.h"
#include "harness/config/mechanism_reader.h"
#include "tests/harness/cli_fixture.h"
#include "tests/harness/in_child.h"

namespace loopbench::harness::trajectory_test {

/// Names that mean something to CSV, gnuplot, shells, HTML or labels themselves.
const std::vector<std::string> kHostile = {
    "a,b\"c\"",  "line\nend\r", "$(touch pwned) `x`",     "a:b\\:c", "</td><b>&amp;'", "x [m]",
    "# comment", "=1+1",        "\xc3\xa9 {/Symbol a}_1", "@%s"};

class File : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = fs::path(testing::TempDir()) / (std::string("loopbench-rows-") + test->name() + ".csv");
    fs::remove(path_);
  }
  void TearDown() override { fs::remove(path_); }

  void Write(const std::string& text) const { WriteFileAtomically(path_, text); }
  /// Why the file is refused, without its name.
  std::string Refusal() const {
    try {
      ReadTrajectory(path_);
    } catch (const std::runtime_error& error) {
      const std::string text = error.what(), name = path_.string();
      EXPECT_TRUE(text.starts_with(name)) << text;
      return text.substr(std::min(text.size(), name.size()));
    }
    return "none";
  }
  fs::path path_;
};

TEST_F(File, KeepsEveryNameAndEveryBit) {
  std::vector<TrajectoryColumn> columns = {{"t", "", "t", "s"}};
  for (const std::string& name : kHostile) {
    columns.push_back({"joint", LabelName(name), "angle", "rad"});
    columns.push_back({"point", LabelName(name) + ":" + LabelName(name + "2"), "x", "m"});
    EXPECT_EQ(ParseLabel(columns.back().Label()), columns.back()) << name;
  }
  std::vector<double> first(columns.size(), 0.1), second(columns.size(), 1e-310);
  first[1] = std::nan(""), second[0] = 1 / 3.0, second[2] = -1.7976931348623157e308;
  TrajectoryWriter writer(path_, columns, {"a note\nof two lines", "reactions: none"});
  EXPECT_FALSE(fs::exists(path_));  // nothing until all is there
  writer.Write(first);
  writer.Write(second);
  writer.Finish({"the end"});
  EXPECT_FALSE(fs::exists(path_.string() + ".part"));
  const Trajectory read = ReadTrajectory(path_);
  EXPECT_EQ(read.columns, columns);
  TrajectoryReader reader(path_);
  EXPECT_EQ(reader.notes(), (std::vector<std::string>{"a note\\nof two lines", "reactions: none"}));
  for (std::vector<double> row; reader.Next(&row);) EXPECT_TRUE(reader.later_notes().empty());
  EXPECT_EQ(reader.later_notes(), std::vector<std::string>{"the end"});
  ASSERT_EQ(read.rows(), 2u);
  EXPECT_TRUE(std::isnan(read.At(0, 1)));
  for (std::size_t i = 0; i < columns.size(); ++i) EXPECT_EQ(read.At(1, i), second[i]);
  EXPECT_EQ(*FindColumn(read.columns, "joint", LabelName(kHostile[0]), "angle"), 1u);
}

TEST_F(File, LeavesNothingUnfinished) {
  { TrajectoryWriter writer(path_, {{"t", "", "t", "s"}}, {}); }
  EXPECT_FALSE(fs::exists(path_));
  EXPECT_FALSE(fs::exists(path_.string() + ".part"));
}

TEST_F(File, OfAnotherProgramIsReadWithWhatItHas) {
  Write(
      "\xef\xbb\xbf# theirs\r\n\"body:crank:x [m]\", t [s] ,\"own \"\"thing\"\"\"\r\n"
      "1, 0,\r\n\r\n# more\r\n+2.5e-1,1e0,nan\r\n");
  const Trajectory read = ReadTrajectory(path_);
  ASSERT_EQ(read.rows(), 2u);
  EXPECT_EQ(read.time, 1u);
  EXPECT_EQ(read.columns[2].kind, "");
  EXPECT_EQ(read.columns[2].component, "own \"thing\"");
  EXPECT_EQ(read.At(1, *FindColumn(read.columns, "body", "crank", "x")), 0.25);
  EXPECT_TRUE(std::isnan(read.At(0, 2)));
}

TEST_F(File, ThatIsNoneIsRefusedWithItsPlace) {
  const std::pair<const char*, const char*> refused[] = {
      {"",
       ":1: found no line of labels, expected labels such as \"t [s]\" and \"joint:A:angle "
       "[rad]\""},
      {"x [m]\n1\n", ":1: found no column \"t [s]\", expected a column of times"},
      {"t [s],t [s]\n", ":1: found \"t [s]\" twice, expected each label once"},
      {"t [s],\"x\n1,2\n",
       ":1: found a quotation mark without its end, expected labels, quoted by RFC 4180"},
      {"t [s],x\n0,1\n1\n", ":3: found 1 values, expected 2, as labels"},
      {"t [s],x\n0,0x10\n", ":2: found \"0x10\" in column 2, expected a number"},
      {"t [s],x\n0,1\n0,1\n", ":3: found t = 0, expected times that rise"},
      {"t [s],x\nnan,1\n", ":2: found t = nan, expected times that rise"}};
  for (const auto& [text, refusal] : refused) {
    Write(text);
    EXPECT_EQ(Refusal(), refusal);
  }
}

TEST_F(File, OfAMillionRowsStreams) {
  InChild([&] {
    // some 45 MB of text, with room for 24 MB more than the program has
    std::ifstream statm("/proc/self/statm");
    std::size_t pages = 0;
    statm >> pages;
    const rlim_t room = pages * 4096 + (24u << 20);
    const rlimit limit{room, room};
    ASSERT_EQ(::setrlimit(RLIMIT_AS, &limit), 0);
    constexpr int kRows = 1'000'000;
    {
      TrajectoryWriter writer(path_, {{"t", "", "t", "s"}, {"body", "a", "x", "m"}}, {});
      for (int i = 0; i < kRows; ++i) writer.Write(std::vector<double>{i * 1e-3, 1.0 / (i + 1)});
      writer.Finish();
    }
    EXPECT_GT(fs::file_size(path_), 24u << 20);
    TrajectoryReader reader(path_);
    int rows = 0;
    for (std::vector<double> row; reader.Next(&row); ++rows) {
      if (row[1] != 1.0 / (rows + 1)) ADD_FAILURE() << rows;
    }
    EXPECT_EQ(rows, kRows);
  });
}

TEST(Output, SaysTimesInOneWay) {
  const OutputOptions tenths{.step = 0.1, .times = {}};
  EXPECT_EQ(OutputTimes(tenths, 1.0).size(), 11u);  // 1 / 0.1 rounds to 10 from below or above
  EXPECT_EQ(OutputTimes(tenths, 0.3).back(), 0.3);
  EXPECT_EQ(OutputTimes(tenths, 0.35).size(), 4u);
  EXPECT_EQ(OutputTimes({.number = 4, .times = {}}, 3.0), (std::vector<double>{0, 1, 2, 3}));
  EXPECT_EQ(OutputTimes({.times = {0.0, 1.0, 5.0}}, 2.0), (std::vector<double>{0, 1}));
  EXPECT_TRUE(OutputTimes({.times = {}, .accepted_steps = true}, 2.0).empty());
}

/// A row of a file's trajectory by the label of its column.
double At(const Trajectory& rows, std::size_t row, const std::string& label) {
  for (std::size_t i = 0; i < rows.columns.size(); ++i) {
    if (rows.columns[i].Label() == label) return rows.At(row, i);
  }
  ADD_FAILURE() << "no " << label;
  return std::nan("");
}

/// The largest constraint violation of all joints.
double Largest(const TrajectoryCheck& check, LargestAt JointCheck::*violation) {
  double largest = 0.0;
  for (const JointCheck& joint : check.joints)
    largest = std::max(largest, (joint.*violation).value);
  return largest;
}

class Command : public CommandLineTest {
 protected:
  /// Each command fails with its text.
  void ExpectRefusals(const std::vector<std::pair<std::string, std::string>>& rows) const {
    for (const auto& [command, text] : rows) Expect(command, 2, {text});
  }
  void WriteExperiment(const std::string& output, const std::string& mechanism,
                       const std::string& more = "") const {
    Write("out.json", R"({"name": "out", "tolerances": 1e-9, "timing": {"repeats": 0},
      "problems": [{"mechanism": ")" +
                          mechanism + R"(", "horizon": 1}],
      "methods": [{"formulation": "odca", "enforcement": "acceleration", "coordinates": "absolute"}],
      "output": )" + output +
                          more + "}");
  }
  std::vector<fs::path> Files(const std::string& folder) const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder_ / folder))
      files.push_back(entry.path());
    return files;
  }
  /// Runs the experiment; returns its first trajectory.
  fs::path Ran(const std::string& output, const std::string& mechanism = "four-bar.json") const {
    WriteExperiment(output, mechanism);
    Expect("run out.json --out out", 0);
    return Files("out/trajectories").at(0);
  }
  static std::string Shipped(const std::string& name) {
    return (kConfigs / "mechanisms" / (name + ".json")).string();
  }
};

TEST_F(Command, MistakesOfOutputAreNamed) {
  const auto refused = [&](const std::string& output, const std::string& found,
                           const std::string& more = "") {
    WriteExperiment(output, "four-bar.json", more);
    Expect("run out.json --out out", 2, {found});
    EXPECT_FALSE(fs::exists(folder_ / "out"));
  };
  refused("{}", "/output: found no times, expected one of");
  refused(R"({"step": 0.1, "number": 3})", "/output: found several definitions of times");
  refused(R"({"times": [1, 1]})", "/output/times: found times that do not rise");
  refused(R"({"accepted_steps": true, "exact": true})", "\"exact\" beside \"accepted_steps\"");
  refused(R"({"step": 1e-300})", "rows, expected at most 100000000");
  refused(R"({"step": 0.1, "quantities": ["poses"]})", "/output/quantities/0");
  refused(R"({"step": 0.1})", "found output of parts that run on their own",
          R"(, "preprocess": {"islands": true})");
}

TEST_F(Command, HostileNamesStayNames) {
  std::string text = mechanism_;
  const auto rename = [&](const std::string& from, const std::string& to) {
    const std::string own = "\"" + from + "\"";
    for (std::size_t at = text.find(own); at != std::string::npos; at = text.find(own, at + 1)) {
      text.replace(at, own.size(), to);
    }
  };
  rename("bar1.angle", R"("a,b\"c\":\\d.angle")");
  rename("bar1", R"("a,b\"c\":\\d")");
  rename("AB", R"("line\nend $(touch pwned) `touch pwned`")");
  rename("OA", R"("# <b>'=1|x [m]")");
  Write("hostile.json", text);
  const fs::path file = Ran(R"({"number": 5})", "hostile.json");
  EXPECT_EQ(Files("out/trajectories").size(), 1u);
  const Trajectory rows = ReadTrajectory(file);
  EXPECT_EQ(rows.rows(), 5u);
  EXPECT_TRUE(FindPose(rows.columns, "a,b\"c\":\\d"));
  EXPECT_TRUE(FindColumn(rows.columns, "joint", LabelName("line\nend $(touch pwned) `touch pwned`"),
                         "angle"));
  EXPECT_TRUE(FindColumn(rows.columns, "reaction", LabelName("# <b>'=1|x [m]"), "fx"));
  Expect(fmt::format("trajectory '{0}' --mechanism hostile.json --compare-with '{0}' "
                     "--figure own.svg",
                     file.string()),
         0, {"by body poses", "wrote own.svg"});
  EXPECT_FALSE(fs::exists(folder_ / "pwned"));
}

/// One joint of every kind with coordinates, each with values that a user gives: a chain, and
/// bodies by themselves. The values are in every-kind-values.txt, by column.
TEST_F(Command, EveryKindOfJointHasTheCoordinatesThatTheUserGave) {
  Write("kinds.json", TestData("every-kind.json"));
  for (const char* coordinates : {"joint", "absolute"}) {
    WriteExperiment(R"({"step": 0.01})", "kinds.json");
    Expect(fmt::format("run out.json --out {0} --set /methods/0/coordinates={0}", coordinates), 0);
    const fs::path file = Files(std::string(coordinates) + "/trajectories").at(0);
    const Trajectory rows = ReadTrajectory(file);
    ASSERT_EQ(rows.rows(), 101u);
    std::istringstream given(TestData("every-kind-values.txt"));
    int number = 0;
    for (std::string item; std::getline(given, item); ++number) {
      const std::string label = item.substr(0, item.find(" = "));
      const double value = std::stod(item.substr(item.find(" = ") + 3));
      // products of ten frames, and in absolute coordinates back
      if (label[0] == 'r' && std::string(coordinates) == "absolute" && label.ends_with("[rad]")) {
        EXPECT_NEAR(std::remainder(At(rows, 0, "joint:" + label) - value, 2 * M_PI), 0.0, 1e-13);
      } else {
        EXPECT_NEAR(At(rows, 0, "joint:" + label), value, 1e-13) << label << ' ' << coordinates;
      }
    }
    EXPECT_EQ(number, 48);
    // whole turns of a joint with two coordinates are those next to the row before, and at first
    // none
    EXPECT_NEAR(std::remainder(At(rows, 0, "joint:c:angle [rad]") + 4.0, 2 * M_PI), 0.0, 1e-13);
    const TrajectoryCheck check =
        CheckTrajectory(file, ReadMechanism(folder_ / "kinds.json").description);
    EXPECT_EQ(check.joints.size(), 14u);
    EXPECT_LE(Largest(check, &JointCheck::shift),
              std::string(coordinates) == "joint" ? 1e-13 : 1e-7);
    for (const JointCheck& joint : check.joints) {
      if (joint.joint != "w") {
        EXPECT_LE(joint.coordinates.value, 1e-12) << joint.joint;
      }
    }
    // Simpson's rule with h = 0.01 s: h^4 / 90 times a fourth derivative of some 1e3
    EXPECT_EQ(check.speeds.size(), 67u);  // three of each body, 25 of joints
    for (const ColumnCheck& speed : check.speeds) EXPECT_LE(speed.apart.value, 1e-6) << speed.label;
    // gravity's potential and kinetic energy: steps at 1e-9
    EXPECT_LE(check.energy.value, 1e-5);
  }
}

TEST_F(Command, AnExportComesBackWithTheDriftOfTheRecord) {
  for (const char* name : {"four-bar", "double-wishbone", "stewart-platform", "bennett"}) {
    WriteExperiment(R"({"accepted_steps": true})", Shipped(name));
    Expect("run out.json --out " + std::string(name), 0);
    const std::vector<Record> records = ReadRecords(folder_ / name);
    ASSERT_EQ(records.size(), 1u);
    const MechanismDescription user = ReadMechanism(Shipped(name)).description;
    Expect(fmt::format("trajectory {0} --out {0}/theirs --columns body:", name), 0, {"rows"});
    const fs::path theirs = Files(std::string(name) + "/theirs").at(0);
    const TrajectoryCheck check = CheckTrajectory(theirs, user);
    EXPECT_EQ(check.source, "body poses");
    EXPECT_EQ(check.rows, static_cast<std::int64_t>(records[0].Number("steps")) + 1);
    // poses of metres go through frames and back
    constexpr double kRounding = 1e-14;
    EXPECT_NEAR(Largest(check, &JointCheck::shift), records[0].Number("drift_position_max"),
                kRounding)
        << name;
    EXPECT_NEAR(Largest(check, &JointCheck::rotation), records[0].Number("drift_rotation_max"),
                kRounding)
        << name;
    const bool has_work = records[0].Find("energy_supplied") != nullptr;
    EXPECT_EQ(check.no_energy.empty(), !has_work) << check.no_energy;
    if (!has_work) {
      EXPECT_NEAR(check.energy.value, records[0].Number("energy_error_max"),
                  1e-13 * records[0].Number("energy_scale") + 1e-12)
          << name;
    }
    // by the joints of the tree alone: what its cut joints then miss
    Expect(fmt::format("trajectory {0} --out {0}/joints --columns joint:", name), 0);
    const TrajectoryCheck closure =
        CheckTrajectory(Files(std::string(name) + "/joints").at(0), user);
    EXPECT_EQ(closure.source, "joint coordinates");
    EXPECT_NEAR(Largest(closure, &JointCheck::shift), records[0].Number("loop_closure_max"),
                10 * kRounding)
        << name;
  }
}

TEST_F(Command, WhatIsMissingIsNamed) {
  Write("theirs.csv", "t [s],joint:OA:angle [rad],body:bar1:x [m]\n0,0,0\n");
  Expect("trajectory theirs.csv --mechanism four-bar.json", 2,
         {"found neither the poses of all bodies nor the coordinates", "\"body:bar1:y [m]\"",
          "\"joint:AB:angle [rad]\""});
  Write("theirs.csv", "t [s],x [m]\n0,0\n");
  Expect("run tiny.json --out out", 0);
  ExpectRefusals(
      {{"trajectory theirs.csv --compare-with theirs.csv", "found no column that both have"},
       {"trajectory out", "found no trajectory"},
       {"trajectory out --mechanism four-bar.json", "found a store beside"},
       {"trajectory theirs.csv --columns y --out y.csv",
        "--columns: found \"y\", expected the beginning of one of"}});
  EXPECT_FALSE(fs::exists(folder_ / "y.csv"));
}

TEST_F(Command, ChangedFilesBesideAStoreFailGates) {
  Ran(R"({"number": 5, "quantities": ["joints"]})");
  for (const char* folder : {"mechanisms", "trajectories"}) {
    fs::remove_all(folder_ / "copy");
    fs::copy(folder_ / "out", folder_ / "copy", fs::copy_options::recursive);
    Expect("compare out copy", 0, {"NO CHANGE"});
    const fs::path file = Files(std::string("copy/") + folder).at(0);
    std::string text = ReadFile(file);
    const std::size_t digit = text.find_last_of("123456789");
    text[digit] = text[digit] == '1' ? '2' : '1';
    WriteFileAtomically(file, text, Onto::kAnyFile);
    for (const char* command : {"compare out copy", "check-claims copy --claims claims.json"}) {
      Expect(command, 2, {file.filename().string(), "changed after its run wrote it"});
    }
  }
}

TEST_F(Command, OptionsWithoutEffectAreRejected) {
  Write("ours.csv", "t [s],joint:OA:angle [rad]\n0,0\n");
  const std::string ours = "trajectory ours.csv ";
  Expect(ours + "--compare-with ours.csv --out x.csv", 2, {"--compare-with", "--out"});
  ExpectRefusals({{ours + "--where rtol=1", "--where: found a trajectory, 'ours.csv'"},
                  {ours + "--format jsonl", "--format requires --out"},
                  {ours + "--every 2", "--every requires --out"},
                  {ours + "--columns t", "--columns: found neither --out"}});
}

TEST_F(Command, EnergiesOfAFileAreCompared) {
  const fs::path file = Ran(R"({"number": 5})");
  const Trajectory ours = ReadTrajectory(file);
  const std::size_t kinetic = *FindColumn(ours.columns, "energy", "", "kinetic"),
                    width = ours.columns.size();
  const auto check = [&](double value) {
    std::vector<double> values = ours.values;
    values[width + kinetic] = value;
    TrajectoryWriter writer(folder_ / "theirs.csv", ours.columns, {}, TrajectoryFormat::kCsv);
    for (std::size_t row = 0; row < ours.rows(); ++row) {
      writer.Write(std::span(values).subspan(row * width, width));
    }
    writer.Finish();
    return Call("trajectory theirs.csv --mechanism four-bar.json");
  };
  ExpectEnding(check(ours.At(1, kinetic) + 1.0), 0,
               {"energy:kinetic [J]: differs from the mechanism by 1.000e+00 J at most",
                "energy:potential [J]: differs from the mechanism by ", " not checked: reaction:"});
  ExpectEnding(check(std::nan("")), 2, {"theirs.csv:3: found nan in \"energy:kinetic [J]\""});
}

TEST_F(Command, AMotionWithoutNumbersIsAnError) {
  const fs::path file = Ran(R"({"number": 5, "quantities": ["joints", "bodies"]})");
  fs::copy_file(file, folder_ / "ours.csv");
  const Trajectory ours = ReadTrajectory(folder_ / "ours.csv");
  const auto write = [&](std::size_t from, const std::string& cell, std::size_t rows = 5) {
    std::string text;
    for (const TrajectoryColumn& column : ours.columns) text += "," + column.Label();
    for (std::size_t row = 0; row < rows; ++row) {
      text += fmt::format("\n{}", ours.At(row, ours.time));
      for (std::size_t i = 1; i < ours.columns.size(); ++i) {
        text += "," + (row < from ? fmt::format("{}", ours.At(row, i)) : cell);
      }
    }
    Write("theirs.csv", text.substr(1) + "\n");
  };
  ASSERT_EQ(ours.time, 0u);
  for (const char* command : {"trajectory theirs.csv --mechanism four-bar.json",
                              "trajectory theirs.csv --compare-with ours.csv"}) {
    write(5, "");
    Expect(command, 0);
    for (const char* cell : {"nan", "inf", "-inf", ""}) {
      for (const std::size_t from : {0u, 1u, 4u}) {
        write(from, cell);
        Expect(command, 2, {"theirs.csv:", "expected a finite number"});
      }
    }
    write(5, "", 0);
    Expect(command, 2, {"theirs.csv:1: found no row"});
  }
  write(1, "nan");
  Expect("trajectory ours.csv --compare-with theirs.csv", 2,
         {"theirs.csv:3: found nan in", "expected a finite number"});
  Expect("trajectory theirs.csv --compare-with theirs.csv", 2, {"found nan in"});
  write(1, "");
  for (const char* command : {"trajectory theirs.csv --mechanism four-bar.json",
                              "trajectory theirs.csv --compare-with ours.csv",
                              "trajectory ours.csv --compare-with theirs.csv"}) {
    Expect(command, 2, {"theirs.csv:3: found an empty cell in"});
  }
  // numbers whose energy is none
  write(1, "1e300");
  Expect("trajectory theirs.csv --mechanism four-bar.json", 0, {"energy: not checked"});
  // columns of another unit are not compared
  Write("degrees.csv", "t [s],joint:OA:angle [rad],joint:AB:angle [deg],x [m]\n0,0,0,0\n");
  Expect("trajectory degrees.csv --compare-with ours.csv", 0,
         {"2 columns of degrees.csv not compared: joint:AB:angle [deg], x [m]",
          " of ours.csv not compared: "});
  Write("empty.csv", "t [s],joint:OA:angle [rad]\n");
  Write("latin.csv", "t [s],w\xFC [m]\n0,0\n");
  ExpectRefusals({{"trajectory empty.csv", "empty.csv:1: found no row, expected a motion"},
                  {"trajectory empty.csv --out copy.csv", "empty.csv:1: found no row"},
                  {"trajectory latin.csv --format jsonl --out x.jsonl",
                   "latin.csv: label 2, byte 3: found the byte FC, which is not UTF-8"}});
  EXPECT_FALSE(fs::exists(folder_ / "copy.csv"));
  Write("early.csv", "t [s],joint:OA:angle [rad]\n-1,0\n0,0\n");
  Expect("trajectory early.csv --compare-with ours.csv", 0, {"1 of 2 rows are not compared"});
}

/// Coordinates of joints determine all poses, whatever a coupling says about them.
TEST_F(Command, CouplingsAreCheckedToo) {
  Write("pair.json", R"({"name": "pair", "gravity": [0, 0], "ground": {"points": {"P": [0.3, 0]}},
    "bodies": [{"name": "w1", "mass": 2, "inertia": 0.02}, {"name": "w2", "mass": 1, "inertia": 0.03}],
    "joints": [{"name": "A", "type": "revolute", "from": {"body": "ground"}, "to": {"body": "w1"}},
      {"name": "B", "type": "revolute", "from": {"body": "ground", "at": "P"}, "to": {"body": "w2"}}],
    "couplings": [{"name": "mesh", "coefficients": {"A": 20, "B": 40}}]})");
  const auto write = [&](double offset, double speed) {
    std::string text =
        "t [s],joint:A:angle [rad],joint:A:angle speed [rad/s],joint:B:angle [rad],"
        "joint:B:angle speed [rad/s]\n";
    for (const double t : {0.0, 0.1, 0.2}) {
      text += fmt::format("{},{},2,{},{}\n", t, 2 * t, offset + speed * t, speed);
    }
    Write("theirs.csv", text);
  };
  const std::string check = "trajectory theirs.csv --mechanism pair.json";
  write(0.0, -1.0);
  Expect(check, 0, {"coupling mesh", "0.00e+00                      0.00e+00"});
  write(2 * M_PI, -1.0);
  Expect(check, 0, {"0.00e+00                      0.00e+00"});
  // 40 (0.5 + 0.2 * 4) / 20 rad at 0.2 s, 40 * 4 / 20 rad/s
  write(0.5, 3.0);
  Expect(check, 0, {"2.60e+00                      8.00e+00"});
}

TEST_F(Command, WholeTurnsAndRowsInBetweenAreNamed) {
  const std::string columns = "t [s],joint:thread:angle [rad]\n";
  Write("ours.csv", columns + "0,0\n1,1\n2,2\n3,3\n");
  Write("theirs.csv", columns + fmt::format("0,{}\n1,1\n1.5,1.5\n", 4 * M_PI));
  Expect("trajectory theirs.csv --compare-with ours.csv", 0,
         {"1 of 3 rows are compared with cubics through the rows of ours.csv",
          "joint:thread:angle [rad]: besides, 2 whole turns at 0 s"});
}

TEST_F(Command, MergeCarriesTrajectoriesAndAResumedRunLeavesNoParts) {
  Write("two.json", std::string(kTinyExperiment).insert(1, R"("output": {"number": 3},)"));
  Expect("run two.json --out one --shard 1/2", 0);
  Expect("run two.json --out two --shard 2/2", 0);
  Expect("merge one two --out whole", 0, {"2 cases"});
  EXPECT_EQ(Files("whole/trajectories").size(), 2u);
  Expect("trajectory whole", 0, {"dense output"});
  // what a killed run leaves goes with the next one
  Write("whole/trajectories/0123.csv.part", "t [s]\n0");
  Expect("run two.json --out whole", 0, {"ran 0 cases"});
  EXPECT_EQ(Files("whole/trajectories").size(), 2u);
  // a process that crashes takes its part along
  ExpectEnding(Call("run two.json --out crashed", "LOOPBENCH_FAULT=crash:formulation=odca"), 0,
               {"not finished"});
  EXPECT_EQ(Files("crashed/trajectories").size(), 1u);
  fs::remove_all(folder_ / "one/trajectories");
  Expect("trajectory one", 2, {"missing; run --rerun all writes it"});
}

TEST_F(Command, OneLineReadsItInGnuplotAndPandas) {
  const fs::path file = Ran(R"({"number": 50})");
  fs::copy_file(file, folder_ / "rows.csv");
  // the lines of docs/trajectories.md
  const std::string trajectories_md =
      ReadFile(fs::path(LOOPBENCH_SOURCE_DIR) / "docs/trajectories.md");
  const std::string plot =
      R"(set datafile separator comma; plot "rows.csv" using "t [s]":"joint:OA:angle [rad]" with lines)";
  const std::string frame =
      R"(import pandas; rows = pandas.read_csv("rows.csv", comment="#", index_col="t [s]"))";
  ExpectWords(trajectories_md, {plot, frame});
  const auto run = [&](const std::string& command) {
    return std::system(("cd '" + folder_.string() + "' && " + command + " >log 2>&1").c_str());
  };
  if (run("gnuplot --version") == 0) {
    Write("plot.gp", "set terminal svg\nset output 'angle.svg'\n" + plot + "\n");
    EXPECT_EQ(run("gnuplot plot.gp"), 0) << ReadFile(folder_ / "log");
    EXPECT_GT(fs::file_size(folder_ / "angle.svg"), 5000u);
  }
  // Debian's interpreter: another one in the path need not have the module
  if (run("/usr/bin/python3 -c 'import pandas'") == 0) {
    Write("frame.py", frame +
                          "\nassert rows.shape[0] == 50, rows.shape\n"
                          "assert rows['joint:OA:angle [rad]'].notna().all()\n");
    EXPECT_EQ(run("/usr/bin/python3 frame.py"), 0) << ReadFile(folder_ / "log");
  }
}

TEST(Compared, RowsMeetAtTheirTimes) {
  Trajectory ours{{{"t", "", "t", "s"}, {"joint", "a", "angle", "rad"}}, {}, 0}, theirs = ours;
  for (int i = 0; i < 10; ++i) {
    const double t = 0.1 * i;
    ours.values.insert(ours.values.end(), {t, t * t * t});
  }
  for (const double t : {-0.1, 0.0, 0.25, 0.9, 1.0}) {
    theirs.values.insert(theirs.values.end(), {t, t * t * t + 2 * M_PI + 0.5});
  }
  const auto shared = SharedColumns(ours, theirs);
  ASSERT_EQ(shared.size(), 1u);
  const std::vector<double> apart = Differences(ours, theirs, shared[0]);
  EXPECT_TRUE(std::isnan(apart[0]) && std::isnan(apart[4]));            // ours has no such time
  for (const int row : {1, 2, 3}) EXPECT_NEAR(apart[row], 0.5, 1e-14);  // a cubic is met exactly
}

}  // namespace loopbench::harness::trajectory_test
