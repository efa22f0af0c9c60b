// generate: C99 that compiles without warnings everywhere, moves as the library does, and an FMU
// that an importer loads, checks and steps. count, and experiments with generated execution.
#include <dlfcn.h>
#include <tinyxml2.h>
#include <unistd.h>

#include "harness/config/mechanism_reader.h"
#include "harness/integrator/arkode.h"
#include "harness/run/run.h"
#include "mechanism/start/assembly.h"
#include "tests/harness/cli_fixture.h"

namespace loopbench::harness {
namespace {

using Numbers = std::vector<double>;

class GenerateTest : public CommandLineTest {
 protected:
  /// Runs a shell command in the folder.
  Ending Shell(const std::string& command) const {
    return Call("--version >/dev/null 2>&1; " + command);
  }

  /// Compiles NAME.c and example.c of `code` with all warnings as errors.
  void Compile(const std::string& compiler, const std::string& name) const {
    ExpectEnding(Shell(compiler +
                       " -std=c99 -pedantic -Wall -Wextra -Werror -O1 -ffp-contract=off "
                       "-o example code/*_example.c code/" +
                       name + ".c -lm"),
                 0, {});
  }

  /// The last line of the example's output.
  Numbers LastRow(const std::string& arguments) const {
    const Ending ending = Shell("./example " + arguments);
    EXPECT_EQ(ending.code, 0) << ending.text;
    std::istringstream lines(ending.text);
    std::string line, last;
    while (std::getline(lines, line)) last = line;
    Numbers numbers;
    std::istringstream cells(last);
    for (std::string cell; std::getline(cells, cell, ',');) numbers.push_back(std::stod(cell));
    return numbers;
  }
};

/// The state of a mechanism file after `seconds` by the library at a tight tolerance.
template <class Space>
Numbers LibraryState(const fs::path& path, const std::string& formulation, double seconds) {
  const MechanismDescription description = ReadMechanism(path).description;
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  const Start<double> start = Assemble<Space>(description, mechanism);
  const auto system = MakeFormulation<Space>(formulation, mechanism, {});
  EXPECT_EQ(system->Start(0.0, start.q, start.u), Outcome::kFinished);
  Numbers y(static_cast<std::size_t>(system->size()));
  system->ToState(start.q, start.u, y);
  IntegratorOptions options;
  options.rtol = options.atol = 1e-12;
  EXPECT_EQ(Integrate(*system, 0.0, seconds, y, options).outcome, Outcome::kFinished);
  return y;
}

/// RK4 with steps of 1e-3 of motions at some rad/s leaves h^4 = 1e-12 times a constant; the bound
/// leaves a factor of 1e4.
constexpr double kMotion = 1e-8;

void ExpectState(const Numbers& row, const Numbers& expected) {
  ASSERT_EQ(row.size(), expected.size() + 2);  // time and energy beside it
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(row[i + 1], expected[i], kMotion);
}

TEST_F(GenerateTest, TheExampleMovesAsTheLibraryDoesForEachFormulation) {
  for (const std::string formulation : {"odca", "lagrange", "reduction"}) {
    Expect("generate four-bar.json --out code --formulation " + formulation, 0,
           {"four_bar.h", "derivative", "jacobian"});
    Compile("cc", "four_bar");
    ExpectState(LastRow("1 1e-3"),
                LibraryState<Planar>(folder_ / "four-bar.json", formulation, 1.0));
  }
}

TEST_F(GenerateTest, MechanismsInSpaceMoveAsTheLibraryDoes) {
  const fs::path spatial = kConfigs / "mechanisms/spatial-four-bar.json";
  Expect("generate '" + spatial.string() + "' --out code --formulation odca", 0);
  Compile("cc", "spatial_four_bar");
  ExpectState(LastRow("0.5 1e-3"), LibraryState<Spatial>(spatial, "odca", 0.5));
}

/// All functions beside dy/dt, called by a program of the user's.
TEST_F(GenerateTest, JacobianEnergyPosesAndProjectionAreThoseOfTheState) {
  Expect("generate four-bar.json --out code", 0);
  Write("user.c", R"(#include <math.h>
#include <stdio.h>
#include <four_bar.h>
enum { N = FOUR_BAR_STATES };
int main(void) {
  double t, y[N], a[N], b[N], J[N * N], e[2], p[4 * FOUR_BAR_BODIES], v[2 * FOUR_BAR_CONSTRAINTS];
  double worst = 0, off = 0, unit = 0;
  int i, j;
  four_bar_start(&t, y);
  if (four_bar_jacobian(t, y, J)) return 1;
  for (j = 0; j < N; ++j) {
    const double kept = y[j], h = 1e-6;
    y[j] = kept + h;
    four_bar_derivative(t, y, a);
    y[j] = kept - h;
    four_bar_derivative(t, y, b);
    y[j] = kept;
    for (i = 0; i < N; ++i) {
      worst = fmax(worst, fabs(J[i + N * j] - (a[i] - b[i]) / (2 * h)) / (1 + fabs(J[i + N * j])));
    }
  }
  if (four_bar_energy(t, y, e) || four_bar_poses(t, y, p)) return 1;
  for (i = 0; i < FOUR_BAR_BODIES; ++i) {
    unit = fmax(unit, fabs(p[4 * i + 2] * p[4 * i + 2] + p[4 * i + 3] * p[4 * i + 3] - 1));
  }
  for (i = 0; i < N; ++i) y[i] += 1e-3 * (i + 1);
  if (four_bar_project(t, y) || four_bar_violation(t, y, v)) return 1;
  for (i = 0; i < 2 * FOUR_BAR_CONSTRAINTS; ++i) off = fmax(off, fabs(v[i]));
  printf("%d %d %d %d\n", worst < 1e-6, unit < 1e-15, off < 1e-14, e[0] >= 0);
  return 0;
}
)");
  const Ending ending = Shell(
      "cc -std=c99 -pedantic -Wall -Wextra -Werror -Icode -o user user.c code/four_bar.c -lm && "
      "./user");
  ExpectEnding(ending, 0, {"1 1 1 1"});
}

TEST_F(GenerateTest, NamesOfUsersNeverBecomeCode) {
  std::string text = mechanism_;
  const auto rename = [&](const std::string& from, const std::string& to) {
    ASSERT_NE(text.find(from), std::string::npos) << from;
    for (std::size_t at = text.find(from); at != std::string::npos;
         at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
  };
  rename("\"name\": \"four-bar\"", R"("name": "2 */ \"; int x??/\n#error")");
  rename("bar1", R"(c\"\n*/??/ @ID@)");
  rename("\"OA\"", R"("%s\\")");
  Write("odd.json", text);
  Expect("generate odd.json --out code", 0, {"mechanism_2"});
  for (const char* compiler : {"gcc", "clang"}) {
    if (Shell(std::string("command -v ") + compiler).code != 0) continue;
    ExpectEnding(Shell(std::string(compiler) +
                       " -std=c99 -pedantic -Wall -Wextra -Werror -c code/mechanism_*.c"),
                 0, {});
  }
}

TEST_F(GenerateTest, TheExampleRejectsInvalidArguments) {
  Expect("generate four-bar.json --out code", 0);
  Compile("cc", "four_bar");
  for (const char* arguments :
       {"abc", "1 0", "1 -1e-3", "-1", "nan", "1 1e-3x", "1e300", "1 1 1"}) {
    ExpectEnding(Shell(std::string("./example ") + arguments), 2, {"usage: ./example [SECONDS"});
  }
  ExpectEnding(Shell("./example 1e300 1e300"), 1, {"a shorter step may help"});
}

/// CMake reserves such names for targets of its own.
TEST_F(GenerateTest, AMechanismMayBeCalledTestOrExample) {
  for (const std::string name : {"test", "example"}) {
    EditMechanism("\"name\": \"four-bar\"", "\"name\": \"" + name + "\"");
    Expect("generate four-bar.json --out " + name, 0, {name + "_example.c"});
    ExpectEnding(Shell("cmake -S " + name + " -B " + name + "/build && cmake --build " + name +
                       "/build && " + name + "/build/" + name + "_example 0.01"),
                 0, {"energy [J]"});
  }
}

/// The code has no impulses.
TEST_F(GenerateTest, JumpsOfSpeedAreRejected) {
  Write("cart.json", R"({"name": "cart", "gravity": [0, -9.81], "bodies": [
    {"name": "cart", "mass": 1.0, "inertia": 1.0}, {"name": "bar", "mass": 1.0, "inertia": 0.1}],
    "joints": [{"name": "slide", "type": "prismatic", "from": {"body": "ground"},
      "to": {"body": "cart"}, "motion": {"type": "table", "interpolation": "linear",
      "times": [0, 1, 2], "values": [0, 0, 1]}},
    {"name": "pin", "type": "revolute", "from": {"body": "cart"},
     "to": {"body": "bar", "at": [0.5, 0]}}]})");
  Expect("generate cart.json --out code", 2,
         {"the motion of joint \"slide\" has jumps of speed", "cubic"});
  EXPECT_FALSE(fs::exists(folder_ / "code"));
}

TEST_F(GenerateTest, EqualInputGivesEqualFiles) {
  for (const char* folder : {"code", "again"}) {
    ExpectEnding(
        Call(std::string("generate four-bar.json --fmu ") + folder + ".fmu --out " + folder), 0,
        {});
  }
  EXPECT_EQ(Shell("sed -i 's/again/code/g' again/*.c again/*.h; diff -r code again").text, "");
}

TEST_F(GenerateTest, BadInputIsNamed) {
  Expect("generate absent.json --out code", 2, {"absent.json"});
  Expect("generate four-bar.json", 2, {"--out"});
  Expect("generate four-bar.json --out code --enforcement projection", 2, {"--enforcement"});
  ExpectEnding(Call("generate four-bar.json --out code --fmu x.fmu", "CC=absent"), 2,
               {"no C compiler", "absent"});
  Expect("generate four-bar.json --out code --fmu .", 2, {"found a folder"});
  EXPECT_FALSE(fs::exists(folder_ / "code"));
  Expect("generate four-bar.json --out code --fmu code/../code/four_bar.c", 2,
         {"--fmu: found \"code/../code/four_bar.c\", expected a file other than"});
  EXPECT_FALSE(fs::exists(folder_ / "code/four_bar.c"));
  EXPECT_FALSE(fs::exists(folder_ / "x.fmu"));
}

// --- the FMU ---

std::uint32_t Little(const std::string& bytes, std::size_t at, int size) {
  std::uint32_t number = 0;
  for (int i = size - 1; i >= 0; --i) {
    number = number << 8 | static_cast<unsigned char>(bytes.at(at + static_cast<std::size_t>(i)));
  }
  return number;
}

/// The files of an archive, by its central directory.
std::map<std::string, std::string> Unzip(const std::string& bytes) {
  std::map<std::string, std::string> files;
  const std::size_t end = bytes.rfind("PK\x05\x06");
  std::size_t at = Little(bytes, end + 16, 4);
  for (std::uint32_t i = 0; i < Little(bytes, end + 10, 2); ++i) {
    EXPECT_EQ(bytes.substr(at, 4), "PK\x01\x02");
    const std::uint32_t size = Little(bytes, at + 20, 4), name = Little(bytes, at + 28, 2);
    const std::size_t local = Little(bytes, at + 42, 4);
    files[bytes.substr(at + 46, name)] = bytes.substr(
        local + 30 + Little(bytes, local + 26, 2) + Little(bytes, local + 28, 2), size);
    at += 46 + name + Little(bytes, at + 30, 2) + Little(bytes, at + 32, 2);
  }
  return files;
}

/// Rules of FMI 2.0.4, sections 2.2.1 to 2.2.8, for what a description here has.
struct Described {
  std::string guid, identifier;
  std::vector<std::string> states;
  std::map<std::string, unsigned> references;
};

Described Check(const std::string& xml, const std::map<std::string, std::string>& files) {
  tinyxml2::XMLDocument document;
  EXPECT_EQ(document.Parse(xml.c_str(), xml.size()), tinyxml2::XML_SUCCESS);
  const tinyxml2::XMLElement* root = document.FirstChildElement("fmiModelDescription");
  EXPECT_STREQ(root->Attribute("fmiVersion"), "2.0");
  Described found{
      .guid = root->Attribute("guid"), .identifier = {}, .states = {}, .references = {}};
  for (const char* kind : {"ModelExchange", "CoSimulation"}) {
    const auto* element = root->FirstChildElement(kind);
    found.identifier = element->Attribute("modelIdentifier");
    const auto* sources = element->FirstChildElement("SourceFiles");
    for (const auto* file = sources->FirstChildElement("File"); file != nullptr;
         file = file->NextSiblingElement()) {
      EXPECT_TRUE(files.contains(std::string("sources/") + file->Attribute("name")));
    }
  }
  std::set<std::string> units;
  for (const auto* unit = root->FirstChildElement("UnitDefinitions")->FirstChildElement("Unit");
       unit != nullptr; unit = unit->NextSiblingElement()) {
    EXPECT_TRUE(units.insert(unit->Attribute("name")).second);
  }
  std::set<unsigned> references;
  std::vector<std::string> names, causalities, initials;
  std::vector<int> derivative_of;
  for (const auto* variable =
           root->FirstChildElement("ModelVariables")->FirstChildElement("ScalarVariable");
       variable != nullptr; variable = variable->NextSiblingElement()) {
    const std::string name = variable->Attribute("name");
    names.push_back(name);
    causalities.emplace_back(variable->Attribute("causality"));
    initials.emplace_back(variable->Attribute("initial"));
    const auto* real = variable->FirstChildElement("Real");
    EXPECT_TRUE(units.contains(real->Attribute("unit"))) << name;
    EXPECT_EQ(real->Attribute("start") != nullptr, initials.back() == "exact") << name;
    derivative_of.push_back(real->IntAttribute("derivative", 0));
    EXPECT_TRUE(
        found.references.emplace(name, variable->UnsignedAttribute("valueReference")).second);
    references.insert(variable->UnsignedAttribute("valueReference"));
  }
  EXPECT_EQ(references.size(), names.size());
  const auto* structure = root->FirstChildElement("ModelStructure");
  const auto unknowns = [&](const char* list) {
    std::vector<std::size_t> indices;
    for (const auto* unknown = structure->FirstChildElement(list)->FirstChildElement("Unknown");
         unknown != nullptr; unknown = unknown->NextSiblingElement()) {
      indices.push_back(unknown->UnsignedAttribute("index") - 1);
      EXPECT_LT(indices.back(), names.size());
    }
    EXPECT_TRUE(std::ranges::is_sorted(indices));
    return indices;
  };
  std::vector<std::size_t> outputs, initial;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (causalities[i] == "output") outputs.push_back(i);
    if (initials[i] == "calculated") initial.push_back(i);
  }
  EXPECT_EQ(unknowns("Outputs"), outputs);
  EXPECT_EQ(unknowns("InitialUnknowns"), initial);
  for (const std::size_t i : unknowns("Derivatives")) {
    const auto state = static_cast<std::size_t>(derivative_of[i] - 1);
    found.states.push_back(names.at(state));
    EXPECT_EQ(names[i], "der(" + names[state] + ")");
  }
  return found;
}

void* Allocate(std::size_t count, std::size_t size) { return std::calloc(count, size); }

/// Functions of FMI 2.0 that are called here.
class Importer {
 public:
  Importer(const fs::path& library, const std::string& guid)
      : handle_(::dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL)) {
    EXPECT_NE(handle_, nullptr) << ::dlerror();
    const auto make =
        Get<void* (*)(const char*, int, const char*, const char*, const void*, int, int)>(
            "fmi2Instantiate");
    EXPECT_EQ(make("no", 0, "{other}", "", &callbacks_, 0, 0), nullptr);
    model_ = make("one", 0, guid.c_str(), "", &callbacks_, 0, 0);
    EXPECT_NE(model_, nullptr);
    EXPECT_EQ(Call<int (*)(void*, int, double, double, int, double)>("fmi2SetupExperiment", 0, 0.0,
                                                                     0.0, 0, 0.0),
              0);
    EXPECT_EQ(Call<int (*)(void*)>("fmi2EnterInitializationMode"), 0);
    EXPECT_EQ(Call<int (*)(void*)>("fmi2ExitInitializationMode"), 0);
  }
  ~Importer() {
    Get<void (*)(void*)>("fmi2FreeInstance")(model_);
    ::dlclose(handle_);
  }
  Importer(const Importer&) = delete;
  Importer& operator=(const Importer&) = delete;

  template <class Function, class... Arguments>
  int Call(const char* name, Arguments... arguments) {
    return Get<Function>(name)(model_, arguments...);
  }
  double Real(unsigned reference) {
    double value = 0.0;
    EXPECT_EQ((Call<int (*)(void*, const unsigned*, std::size_t, double*)>(
                  "fmi2GetReal", &reference, std::size_t{1}, &value)),
              0);
    return value;
  }

 private:
  template <class Function>
  Function Get(const char* name) {
    void* symbol = ::dlsym(handle_, name);
    EXPECT_NE(symbol, nullptr) << name;
    return reinterpret_cast<Function>(symbol);
  }

  struct {
    void* logger = nullptr;
    void* (*allocate)(std::size_t, std::size_t) = &Allocate;
    void (*release)(void*) = &std::free;
    void* step_finished = nullptr;
    void* environment = nullptr;
  } callbacks_;
  void* handle_;
  void* model_ = nullptr;
};

TEST_F(GenerateTest, TheFmuIsValidAndMovesAsTheLibraryDoes) {
  Expect("generate four-bar.json --out code --fmu four-bar.fmu", 0, {"four-bar.fmu"});
  const auto files = Unzip(ReadFile(folder_ / "four-bar.fmu"));
  ASSERT_TRUE(files.contains("modelDescription.xml"));
  const Described described = Check(files.at("modelDescription.xml"), files);
  const std::string binary = "binaries/linux64/" + described.identifier + ".so";
  ASSERT_TRUE(files.contains(binary));
  Write("model.so", files.at(binary));
  Importer model(folder_ / "model.so", described.guid);

  const Numbers expected = LibraryState<Planar>(folder_ / "four-bar.json", "reduction", 1.0);
  ASSERT_EQ(described.states.size(), expected.size());
  // model exchange: derivatives at the start, and of a state that was set
  Numbers x(expected.size()), rates(x.size());
  EXPECT_EQ((model.Call<int (*)(void*, double*, std::size_t)>("fmi2GetContinuousStates", x.data(),
                                                              x.size())),
            0);
  EXPECT_EQ((model.Call<int (*)(void*, double*, std::size_t)>("fmi2GetDerivatives", rates.data(),
                                                              x.size())),
            0);
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_EQ(model.Real(described.references.at(described.states[i])), x[i]);
    EXPECT_EQ(model.Real(described.references.at("der(" + described.states[i] + ")")), rates[i]);
  }
  const double energy = model.Real(described.references.at("energy.kinetic")) +
                        model.Real(described.references.at("energy.potential"));
  // co-simulation to 1 s in steps that are no multiple of the integrator's
  for (int i = 0; i < 64; ++i) {
    ASSERT_EQ(
        (model.Call<int (*)(void*, double, double, int)>("fmi2DoStep", i / 64.0, 1 / 64.0, 1)), 0);
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_NEAR(model.Real(described.references.at(described.states[i])), expected[i], kMotion);
  }
  EXPECT_NEAR(model.Real(described.references.at("energy.kinetic")) +
                  model.Real(described.references.at("energy.potential")),
              energy, kMotion);
  EXPECT_EQ((model.Call<int (*)(void*, double, double, int)>("fmi2DoStep", 1.0, -1.0, 1)), 3);
}

/// Cases of a sweep call compiled code together. One that crashes leaves the others their records.
TEST_F(GenerateTest, CasesOfASweepShareCallsAndHaveTheBitsThatTheyHaveAlone) {
  Write("sweep.json", R"({"name": "sweep", "timing": {"repeats": 0}, "tolerances": [1e-6],
    "problems": [{"mechanism": ")" +
                          (kRoot / "configs/mechanisms/double-wishbone.json").string() +
                          R"(", "horizon": 0.1}],
    "methods": [{"formulation": ["odca", "lagrange"], "enforcement": "projection",
                 "execution": "generated"}],
    "sweep": [{"name": "mass", "field": "/problems/0/mechanism/bodies/2/mass",
               "values": {"lin": [1.1, 2.3, 5]}}]})");
  Expect("run sweep.json --out shared --jobs 1", 0, {"ran 10 cases in "});
  Expect("run sweep.json --out alone --isolate", 0, {"ran 10 cases, 0 reused"});
  ExpectEnding(Call("run sweep.json --out faulty --jobs 1", "LOOPBENCH_FAULT=crash:mass=1.7"), 0,
               {"(2 not finished)"});
  const std::vector<Record> alone = ReadRecords(folder_ / "alone");
  for (const char* name : {"shared", "faulty"}) {
    const std::vector<Record> records = ReadRecords(folder_ / name);
    ASSERT_EQ(records.size(), alone.size());
    for (const Record& record : records) {
      if (record.Number("mass") == 1.7 && name == std::string("faulty")) {
        EXPECT_EQ(record.Text("outcome"), "crashed");
        continue;
      }
      const auto same = std::ranges::find(alone, record.Text("id"),
                                          [](const Record& one) { return one.Text("id"); });
      ASSERT_NE(same, alone.end());
      EXPECT_EQ(record.Text("state_hash"), same->Text("state_hash"));
      EXPECT_EQ(record.Number("library_evaluations"), same->Number("library_evaluations"));
      EXPECT_GT(record.Number("cpu_s"), 0.0);
    }
  }
}

/// The compiler ends the program that called it, which works in a process of its own.
TEST_F(GenerateTest, SignalsLeaveNoTemporaryFiles) {
  Write("cc.sh",
        "#!/bin/sh\ncase \"$*\" in *--version*) exec cc --version;; esac\necho > \"$TMPDIR/part\"\n"
        "read pid < pid; kill -$SIGNAL $pid; exec sleep 9\n");
  fs::permissions(folder_ / "cc.sh", fs::perms::owner_all);
  Write("call.sh", "echo $$ > pid; exec \"$@\"\n");
  fs::create_directory(folder_ / "tmp");
  for (const std::string signal : {"TERM", "HUP", "INT"}) {
    const Ending ending = Call("generate four-bar.json --out code --fmu x.fmu",
                               "SIGNAL=" + signal + " CC=./cc.sh TMPDIR=$PWD/tmp sh call.sh");
    EXPECT_GE(ending.code, 128) << ending.text;
    // the child process may end after its parent
    for (int i = 0; i < 500 && !fs::is_empty(folder_ / "tmp"); ++i) ::usleep(10'000);
    EXPECT_TRUE(fs::is_empty(folder_ / "tmp")) << signal;
  }
}

class CountTest : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    ::setenv("XDG_CACHE_HOME", folder_.c_str(), 1);
  }
  void TearDown() override {
    ::unsetenv("XDG_CACHE_HOME");
    CommandLineTest::TearDown();
  }
};

TEST_F(CountTest, PrintsARowForEachRightHandSide) {
  const Ending ending =
      Call("count four-bar.json --coordinates joint --enforcement acceleration,velocity");
  ExpectEnding(ending, 0, {"flops", "depth", "odca", "lagrange", "reduction", "McMahon"});
  const Ending json = Call("count four-bar.json --formulation odca --format json");
  ExpectEnding(json, 0, {"\"flops\":", "\"additions\":", "\"flops_as_run\":"});
  EXPECT_EQ(std::ranges::count(json.text, '{'), 6);  // three levels, two coordinate sets
}

TEST_F(CountTest, BadInputIsNamedWithFileAndExpectation) {
  Expect("count absent.json", 2, {"absent.json"});
  const std::string before = ReadFile(folder_ / "four-bar.json");
  Expect("count four-bar.json --out four-bar.json", 2, {"four-bar.json"});
  EXPECT_EQ(ReadFile(folder_ / "four-bar.json"), before);
  EditMechanism("\"mass\": 1.0", "\"mass\": \"heavy\"");
  Expect("count four-bar.json", 2,
         {"four-bar.json", "/bodies/0/mass: found \"heavy\"", "expected a number > 0"});
  Expect("count four-bar.json --enforcement postion", 2, {"--enforcement", "postion"});
  Expect("count", 2, {"neither mechanisms nor --family"});
}

/// With light bodies on its loops, the rank of multipliers in absolute coordinates needs a
/// factorisation that iterates.
std::string Iterating() {
  std::string text = ReadFile(kConfigs / "mechanisms/double-wishbone.json");
  for (const std::string mass : {"\"mass\": 2.5", "\"mass\": 0.8"}) {
    text.replace(text.find(mass), mass.size(), "\"mass\": 1e-9");
  }
  return text;
}

TEST_F(CountTest, WhatIsNotRecordedIsARowWithTheReason) {
  Write("iterating.json", Iterating());
  Expect("count iterating.json --formulation lagrange --coordinates absolute", 2,
         {"not recorded", "more than 100000 operations"});
}

TEST_F(CountTest, LevelPositionHasItsNewtonStepBesideIt) {
  Expect("count four-bar.json --enforcement projection", 0, {"Newton step"});
}

/// Sparse multipliers of a chain grow by the same number for each body from ten bodies on; the
/// exponent is that of a line with an offset.
TEST_F(CountTest, FamiliesHaveExponentsAndCrossovers) {
  // above 16 bodies one rule makes all plans of chains (plan.h)
  const Ending ending = Call(
      "count --family chain --sizes 3,20,40 --enforcement acceleration --format jsonl --out "
      "chain.jsonl");
  ExpectEnding(ending, 0, {});
  std::map<std::string, std::vector<double>> exponents;
  for (const Record& row : ReadRecords(folder_ / "chain.jsonl")) {
    const Value* exponent = row.Find("exponent");
    if (exponent == nullptr) continue;
    exponents[std::get<std::string>(*row.Find("formulation")) + " " +
              std::get<std::string>(*row.Find("coordinates"))]
        .push_back(std::get<double>(*exponent));
  }
  EXPECT_NEAR(exponents["odca joint"].back(), 1.0, 0.2);
  EXPECT_NEAR(exponents["lagrange absolute"].back(), 1.0, 0.1);
  EXPECT_GT(exponents["lagrange joint"].back(), 1.8);
  Expect("count --family chain --sizes 3,16 --enforcement acceleration", 0,
         {"fewest operations at level acceleration, rank-revealing: from 3 bodies reduction, "
          "joint; from 16 bodies odca, joint (to 16)"});
  Expect("plot chain.jsonl --x bodies --y flops_per_body --out chain.svg", 0);
  Expect("count --family chain", 2, {"found no --sizes", "3 to 1000000"});
  Expect("count --family chain --sizes 2", 2, {"found 2", "bars of a closed chain"});
  Expect("count --sizes 2", 2, {"--family"});
}

/// Reduction of a serial arm in space contains Newton-Euler, composite rigid bodies, and a solution
/// by Cholesky. Published numbers of operations of general arms with revolute joints are upper
/// bounds: Luh, Walker and Paul (1980); Walker and Orin (1982), method 3; a symmetric solution.
TEST_F(CountTest, SerialArmsNeedFewerOperationsThanPublishedAlgorithms) {
  ExpectEnding(
      Call("count --family arm --sizes 2,3,6,10,20,40 --formulation reduction --enforcement "
           "acceleration --coordinates joint --format jsonl --out arms.jsonl"),
      0, {});
  int rows = 0;
  for (const Record& row : ReadRecords(folder_ / "arms.jsonl")) {
    const auto number = [&](const char* key) { return std::get<std::int64_t>(*row.Find(key)); };
    const std::int64_t n = number("bodies");
    EXPECT_LE(number("multiplications"),
              (150 * n - 48) + (12 * n * n + 56 * n - 27) + (n * n * n + 9 * n * n + 2 * n) / 6)
        << n;
    EXPECT_LE(number("additions"),
              (131 * n - 48) + (7 * n * n + 67 * n - 53) + (n * n * n + 6 * n * n - 7 * n) / 6)
        << n;
    ++rows;
  }
  EXPECT_EQ(rows, 6);
}

TEST_F(CountTest, PartsOfACountAddUp) {
  Expect("count four-bar.json --format jsonl --out rows.jsonl", 0);
  for (const Record& row : ReadRecords(folder_ / "rows.jsonl")) {
    const auto number = [&](const char* key) { return std::get<std::int64_t>(*row.Find(key)); };
    EXPECT_EQ(number("kinematics") + number("forces") + number("solve"), number("flops"));
    EXPECT_GT(number("kinematics"), 0);
    EXPECT_GT(number("solve"), 0);
    EXPECT_LE(number("solve_depth"), number("depth"));
  }
}

TEST_F(CountTest, TheManualPageAndTheCompletionKnowIt) {
  EXPECT_NE(Call("manual").text.find(".SS loopbench count"), std::string::npos);
  EXPECT_NE(Call("completion bash").text.find("count"), std::string::npos);
  Expect("count --help", 0, {"Examples:", "--formulation", "docs/operation-counts.md"});
}

/// Rows of a table in CSV by their keys, without notes.
std::map<std::string, std::string> RowsByKey(const std::string& csv) {
  std::map<std::string, std::string> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    std::size_t end = 0;
    for (int i = 0; i < 5; ++i) end = line.find(',', end) + 1;
    rows[line.substr(0, end - 1)] = line.substr(end);
  }
  return rows;
}

/// A gate of exact counts, without times. `loopbench count` renews the file
/// (results/methods/README.md). Rows that are not exact, where rounding decides an iteration or a
/// pivot, are not compared. The table is of the portable build; in others a few rows may not be
/// exact.
class CountGate : public CountTest, public testing::WithParamInterface<std::string> {};

TEST_P(CountGate, CountsOfAllMechanismsAreThoseOfTheCommittedTable) {
  const fs::path kept = fs::path(LOOPBENCH_SOURCE_DIR) / "results/methods/counts.csv";
  const Ending now = Call("count '" + (kConfigs / "mechanisms").string() +
                          "'/*.json --format csv --out counts.csv --coordinates " + GetParam());
  ASSERT_EQ(now.code, 0) << now.text;
  const auto found = RowsByKey(ReadFile(folder_ / "counts.csv"));
  const auto expected = RowsByKey(ReadFile(kept));
  int exact = 0, rounded_here = 0;
  for (const auto& [key, counts] : expected) {
    if (key.find("," + GetParam() + ",") == std::string::npos) continue;
    if (!counts.ends_with(",yes,")) continue;
    const auto row = found.find(key);
    if (row != found.end() && row->second.ends_with(",no,")) {
      ++rounded_here;
      continue;
    }
    ++exact;
    EXPECT_EQ(row == found.end() ? "no row" : row->second, counts) << key;
  }
  EXPECT_GT(exact, 300);
  EXPECT_LE(rounded_here, 4);
  for (const auto& [key, counts] : found) EXPECT_TRUE(expected.contains(key)) << key << " is new";
}

INSTANTIATE_TEST_SUITE_P(Coordinates, CountGate, testing::Values("joint", "absolute"),
                         [](const auto& set) { return set.param; });

TEST_F(CountTest, GeneratedExecutionIsAFactorOfExperiments) {
  Write("both.json", R"({
    "name": "both", "tolerances": [1e-6],
    "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
    "methods": [{"formulation": ["odca", "reduction"], "enforcement": "velocity",
                 "execution": ["library", "generated"]}],
    "timing": {"repeats": 0}})");
  Expect("list both.json", 0, {"execution", "generated"});
  Expect("run both.json --out out", 0);
  const Ending table = Call(
      "table out --format csv --columns formulation,execution,outcome,library_evaluations,"
      "rhs_evaluations");
  EXPECT_NE(table.text.find("odca,generated,finished,0,"), std::string::npos) << table.text;
  EXPECT_NE(table.text.find("reduction,generated,finished,0,"), std::string::npos) << table.text;
  EXPECT_NE(table.text.find("odca,,finished,,"), std::string::npos) << table.text;
}

/// Whole runs have equal bits, except for the sign of zeros, in general and generated code, and
/// equal measures, also where constraints are regularized.
TEST_F(CountTest, GeneratedRunsHaveTheBitsOfGeneralOnes) {
  Write("bits.json", fmt::format(R"({{
    "name": "bits", "tolerances": [1e-8],
    "problems": [{{"mechanism": "{0}/andrews-squeezer.json", "horizon": 0.01}},
                 {{"mechanism": "{0}/bennett.json", "horizon": 0.3}},
                 {{"mechanism": "{0}/flyball-governor.json", "horizon": 0.1}},
                 {{"mechanism": "{0}/parallelogram-singular-start.json", "horizon": 0.5}},
                 {{"mechanism": "{0}/slider-crank.json", "horizon": 0.5}}],
    "methods": [{{"formulation": ["odca", "lagrange", "reduction"],
                 "enforcement": ["acceleration", "velocity", "projection"],
                 "execution": ["general", "generated"]}}],
    "timing": {{"repeats": 0}}}})",
                                 (kConfigs / "mechanisms").string()));
  Call("run bits.json --jobs 2 --out out");
  std::map<std::string, Record> first;
  int compared = 0;
  std::int64_t regularized = 0;
  for (const Record& row : ReadRecords(folder_ / "out")) {
    if (row.Text("outcome") == "unsupported") continue;
    const bool may_end = row.Text("mechanism") == "parallelogram-singular-start";
    EXPECT_TRUE(may_end || row.Text("outcome") == "finished") << row.Text("message");
    const std::string key =
        row.Text("mechanism") + " " + row.Text("formulation") + " " + row.Text("enforcement");
    const auto [other, is_first] = first.emplace(key, row);
    if (is_first) continue;
    for (const char* measure :
         {"outcome", "state_hash", "steps", "drift_position_max", "energy_error_max", "rank_min",
          "rcond_min", "regularized_evaluations"}) {
      const Value *general = other->second.Find(measure), *generated = row.Find(measure);
      ASSERT_EQ(general == nullptr, generated == nullptr) << key << " " << measure;
      if (general == nullptr) continue;
      EXPECT_EQ(*general, *generated) << key << " " << measure;
    }
    const Value* count = row.Find("regularized_evaluations");
    if (count != nullptr) regularized += std::get<std::int64_t>(*count);
    ++compared;
  }
  EXPECT_GE(compared, 38);
  EXPECT_GT(regularized, 0);
}

/// Drift at level projection is round-off.
TEST_F(CountTest, GeneratedRightHandSidesServeLevelPosition) {
  Write("position.json", R"({
    "name": "position", "tolerances": [1e-6],
    "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
    "methods": [{"formulation": ["odca", "lagrange", "reduction"], "enforcement": "projection",
                 "execution": "generated"}],
    "timing": {"repeats": 0}})");
  Expect("run position.json --out out", 0);
  for (const Record& row : ReadRecords(folder_ / "out")) {
    EXPECT_EQ(std::get<std::string>(*row.Find("outcome")), "finished");
    EXPECT_LT(std::get<double>(*row.Find("drift_position_max")), 1e-14);
    EXPECT_LE(std::get<std::int64_t>(*row.Find("library_evaluations")), 3);
  }
}

/// A pendulum whose angle is prescribed: the work of its drive is all that is integrated.
TEST_F(CountTest, AMechanismWithoutStateRunsInEachExecution) {
  Write("driven.json", R"({
    "name": "driven", "space": "planar", "gravity": [0.0, -9.81], "ground": {"points": {"O": [0.0, 0.0]}},
    "bodies": [{"name": "bar", "mass": 1.3, "inertia": 0.7, "points": {"A": [0.6, 0.0]}}],
    "joints": [{"name": "J", "type": "revolute", "from": {"body": "ground", "at": "O"},
                "to": {"body": "bar", "at": "A"},
                "motion": {"type": "harmonic", "amplitude": 0.5, "omega": 2.0}}]})");
  Write("run.json", R"({
    "name": "run", "tolerances": [1e-8], "problems": [{"mechanism": "driven.json", "horizon": 0.5}],
    "methods": [{"formulation": ["odca", "lagrange", "reduction"],
                 "enforcement": ["acceleration", "projection"],
                 "execution": ["library", "general", "generated"]}],
    "timing": {"repeats": 1}})");
  Expect("run run.json --out out", 0);
  int rows = 0;
  for (const Record& row : ReadRecords(folder_ / "out")) {
    EXPECT_EQ(row.Text("outcome"), "finished") << row.Text("message");
    ++rows;
  }
  EXPECT_EQ(rows, 2 * 18);
  Expect("count driven.json --coordinates joint", 2,
         {"not recorded", "prescribed motions leave no state to integrate"});
}

TEST_F(CountTest, WhatIsNotGeneratedEndsByName) {
  Write("iterating.json", Iterating());
  Write("none.json", R"({
    "name": "none", "tolerances": [1e-6],
    "problems": [{"mechanism": "iterating.json", "horizon": 0.5}],
    "methods": [{"formulation": "lagrange", "enforcement": "projection", "coordinates": "absolute",
                 "execution": "generated"}],
    "timing": {"repeats": 0}})");
  Call("run none.json --out out");
  Expect("table out --format csv --columns outcome,message", 0,
         {"unsupported", "more than 100000 operations"});
  Write("typo.json", R"({
    "name": "typo", "tolerances": [1e-6],
    "problems": [{"mechanism": "four-bar.json", "horizon": 0.5}],
    "methods": [{"formulation": "odca", "enforcement": "velocity", "execution": "generate"}]})");
  Expect("check typo.json", 2,
         {"/methods/0/execution", "found \"generate\"", "did you mean \"generated\""});
}

}  // namespace
}  // namespace loopbench::harness
