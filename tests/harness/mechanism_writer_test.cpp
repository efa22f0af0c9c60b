// A mechanism that is written and read is the same mechanism: every field, and the bits of a run.
#include "harness/config/experiment_reader.h"
#include "harness/config/mechanism_reader.h"
#include "harness/run/run.h"
#include "mechanism/simplify/redundancy.h"
#include "tests/contract/generators.h"
#include "tests/harness/places.h"

namespace loopbench::harness::mechanism_writer_test {

using testing::AnyMechanism;
using testing::DrawnKinds;
using testing::MixedGraph;
using testing::RandomTree;

std::string TextOf(const TimeFunctionDescription& function) {
  std::string text;
  const auto add = [&](double number) { text += fmt::format(" {}", number); };
  if (const auto* polynomial = std::get_if<Polynomial>(&function)) {
    text = "polynomial";
    for (const double c : polynomial->coefficients) add(c);
  } else if (const auto* harmonic = std::get_if<Harmonic>(&function)) {
    text = "harmonic";
    for (const double x : {harmonic->mean, harmonic->amplitude, harmonic->omega, harmonic->phase})
      add(x);
  } else {
    const TimeTable& table = std::get<TimeTable>(function);
    text = table.cubic ? "cubic" : "linear";
    for (const double t : table.times) add(t);
    for (const double y : table.values) add(y);
  }
  return text;
}

std::string TextOf(const Eigen::Vector3d& v) {
  return fmt::format("({} {} {})", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
}

/// Every number with all its digits, written without the fields that are under test. Values of
/// joints that follow a given motion in their only coordinate say nothing, and are left out.
std::string Everything(const MechanismDescription& d) {
  // a new member must be thought about here: this line stops compiling
  const auto& [name, space, gravity, bodies, joints, couplings, forces, initial, independent,
               accuracy, rounded] = d;
  std::string text = fmt::format("{} {} {}\n", name, ToString(space), TextOf(gravity));
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const auto& [body_name, mass, com, inertia, points] = bodies[i];
    text += fmt::format("body {}", i == kGround ? "ground" : body_name);
    if (i != kGround) {
      text += fmt::format(" {} {}", mass, TextOf(com));
      for (int k = 0; k < 3; ++k) text += TextOf(Eigen::Vector3d(inertia.col(k)));
    }
    for (const auto& [point, at] : points) text += fmt::format(" {} {}", point, TextOf(at));
    text += "\n";
  }
  for (const JointDescription& joint : joints) {
    text +=
        fmt::format("joint {} {} {} {} {} {} {} {}{}{} cut {}", joint.name, ToString(joint.type),
                    joint.from.body, joint.to.body, TextOf(joint.from.position),
                    TextOf(joint.from.rotation), TextOf(joint.to.position),
                    TextOf(joint.to.rotation), TextOf(joint.axis), joint.parameter, joint.cut);
    for (const PrescribedMotion& motion : joint.motions) {
      text += fmt::format(" [{} {}]", motion.coordinate, TextOf(motion.value));
    }
    text += "\n";
  }
  for (const CouplingDescription& coupling : couplings) {
    text += fmt::format("coupling {} {}", coupling.name, coupling.offset);
    for (const auto& [joint, ratio] : coupling.parts) text += fmt::format(" {}*{}", ratio, joint);
    text += "\n";
  }
  for (ForceDescription force : forces) {
    const ForceParts parts = PartsOf(force);
    text += fmt::format("force {}", parts.name);
    if (parts.joint != nullptr) text += fmt::format(" joint {}", *parts.joint);
    for (const BodyPoint* point : parts.points)
      text += fmt::format(" {} {}", point->body, TextOf(point->at));
    if (parts.value != nullptr) text += TextOf(*parts.value);
    if (parts.force != nullptr)
      text += fmt::format(" {} {}", TextOf(*parts.force), *parts.in_body_axes);
    for (const ForceNumber& number : parts.numbers) text += fmt::format(" {}", *number.value);
    text += "\n";
  }
  const auto follows = [&](int joint) {
    return !joints[joint].motions.empty() && NumValues(joints[joint].type, space, true) == 1;
  };
  for (const auto* list : {&initial.coordinates, &initial.speeds}) {
    for (const JointValues& values : *list) {
      if (!follows(values.joint))
        text += fmt::format("{}: {}\n", values.joint, fmt::join(values.values, " "));
    }
  }
  for (const int held : initial.held) text += follows(held) ? "" : fmt::format("held {}\n", held);
  // files release nothing, and so nothing that is rounded
  EXPECT_FALSE(rounded);
  return text + fmt::format("{} accuracy {}", fmt::join(independent, " "), accuracy);
}

std::string Everything(const ObservedQuantities& observe) {
  const auto& [branch, form, length, expected] = observe;
  std::string text = fmt::format("length {}", length);
  if (expected) text += fmt::format(" freedom {}", expected->degrees_of_freedom);
  for (const AngleCombination& combination : branch) {
    for (const auto& [body, factor] : combination) text += fmt::format(" {}*{}", factor, body);
    text += ";";
  }
  if (form) text += fmt::format(" {} {} {}", form->body, form->down_angle, form->frequency_squared);
  return text;
}

/// Random descriptions as files say them: inertias that bodies have (tr(S) - S of their second
/// moments S), and a name for each joint.
MechanismDescription AsInFiles(MechanismDescription d) {
  for (BodyDescription& body : d.bodies) {
    const Eigen::Matrix3d second = body.inertia;
    body.inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
  }
  for (std::size_t j = 0; j < d.joints.size(); ++j) d.joints[j].name += fmt::format("/{}", j);
  return d;
}

void ExpectRoundTrip(const MechanismDescription& d, const ObservedQuantities& observe = {}) {
  SCOPED_TRACE(d.name);
  const std::string text = MechanismText(d, observe, "any words");
  const MechanismFile read = ParseMechanism(text, "written");
  EXPECT_EQ(Everything(read.description), Everything(d));
  EXPECT_EQ(Everything(read.observe), Everything(observe));
  EXPECT_EQ(MechanismText(read.description, read.observe, "any words"), text);
}

TEST(MechanismWriter, ShippedMechanismsReadBackTheSame) {
  const std::vector<std::filesystem::path> files = JsonFilesIn(kConfigs / "mechanisms");
  EXPECT_GT(files.size(), 30u);
  for (const std::filesystem::path& path : files) {
    const MechanismFile file = ReadMechanism(path);
    ExpectRoundTrip(file.description, file.observe);
  }
}

TEST(MechanismWriter, RandomMechanismsReadBackTheSame) {
  std::set<std::string> joints, forces, functions;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const SpaceKind space : {SpaceKind::kPlanar, SpaceKind::kSpatial}) {
      for (const MechanismDescription& random :
           {AnyMechanism(8, 3, 3, space, seed, DrawnKinds::kAll), MixedGraph(2, space, seed, 2),
            RandomTree(9, space, seed)}) {
        const MechanismDescription d = AsInFiles(random);
        ExpectRoundTrip(d);
        for (const auto& joint : d.joints) {
          joints.emplace(ToString(joint.type));
          for (const auto& motion : joint.motions)
            functions.insert(TextOf(motion.value).substr(0, 4));
        }
        for (ForceDescription force : d.forces) {
          const ForceParts parts = PartsOf(force);
          forces.emplace(parts.name);
          if (parts.value != nullptr) functions.insert(TextOf(*parts.value).substr(0, 4));
        }
      }
    }
  }
  // otherwise something was not tested
  EXPECT_EQ(joints.size(), 15u);
  EXPECT_EQ(forces.size(), 6u);
  EXPECT_GE(functions.size(), 4u);  // polynomials, harmonics, both kinds of table
}

std::string HashOfRun(const MechanismFile& mechanism) {
  Experiment experiment =
      ReadExperiments(kConfigs / "experiments/examples/published-problems.json").front();
  ExperimentProblem problem;
  problem.name = mechanism.description.name;
  problem.mechanism = mechanism;
  problem.horizons = {0.02};
  experiment.problems = {problem};
  Case one = Expand(experiment).front();
  one.rtol = one.atol = 1e-6;
  one.horizon = 0.02;
  one.ensemble = 1;
  const Record record = RunCase(experiment, one);
  EXPECT_EQ(record.Text("outcome"), "finished") << record.Text("message");
  return record.Text("state_hash");
}

TEST(MechanismWriter, ARunOfWhatWasWrittenHasTheSameBits) {
  for (const char* name : {"slider-crank", "double-wishbone", "stewart-platform", "screw-jack",
                           "driven-four-bar", "rod-pendulum", "bennett"}) {
    MechanismFile file = ReadMechanism(kConfigs / "mechanisms" / (std::string(name) + ".json"));
    const std::string hash = HashOfRun(file);
    EXPECT_FALSE(hash.empty()) << name;
    EXPECT_EQ(HashOfRun(ParseMechanism(MechanismText(file.description, file.observe), name)), hash)
        << name;
    file.description.bodies.back().mass *= 1.0 + 1e-12;
    file.description.gravity *= 1.0 + 1e-12;  // all that moves a single point mass
    EXPECT_NE(HashOfRun(file), hash) << name << ": a hash that nothing changes shows nothing";
  }
}

TEST(MechanismWriter, PointsKeepTheirNames) {
  const MechanismFile file = ReadMechanism(kConfigs / "mechanisms/slider-crank.json");
  const std::string text = MechanismText(file.description, file.observe);
  ExpectWords(text, {"\"at\": \"A\""});
  EXPECT_EQ(text.find("\"preload\""), std::string::npos) << "a default is not written\n" << text;
}

std::string Refusal(const MechanismDescription& d) {
  return MessageOf([&] { MechanismText(d, {}); });
}

TEST(MechanismWriter, WhatNoFileSaysIsRefusedAndNotLost) {
  MechanismDescription d = ReadMechanism(kConfigs / "mechanisms/bennett.json").description;
  EXPECT_EQ(Refusal(d), "");
  ExpectWords(Refusal(Release(d, FindRedundancy(d))), {"found released directions, expected none"});
  MechanismDescription twice = d;
  twice.bodies[2].name = twice.bodies[1].name;
  ExpectWords(Refusal(twice), {"a name that is not in use yet"});
  MechanismDescription no_body = d;
  no_body.bodies[1].inertia = Eigen::Vector3d(1.0, 1.0, 5.0).asDiagonal();
  ExpectWords(Refusal(no_body), {"triangle inequality"});
}

}  // namespace loopbench::harness::mechanism_writer_test
