// Models of a problem against the whole mechanism, point by point. Exact models agree up to errors
// of the integrator. The error of approximate models vanishes with the neglected quantity, and is
// large if that quantity is large.
#include "harness/config/mechanism_reader.h"
#include "harness/run/run.h"
#include "mechanism/simplify/model.h"
#include "mechanism/simplify/restart.h"
#include "tests/harness/places.h"
#include "tests/reference/simulate.h"

namespace loopbench::harness::reference::simplify_test {

MechanismDescription Problem(const std::string& path) {
  return ReadMechanism(kConfigs / (path + ".json")).description;
}

MechanismDescription Model(const std::string& name) {
  return Problem("experiments/models/" + name);
}

const SimplificationRule& IdeaOf(const std::string& name) {
  return *std::ranges::find(SimplificationRules(), name, &SimplificationRule::name);
}

/// Returns the model as it is written and read again.
MechanismDescription AsWritten(const MechanismDescription& description) {
  return ParseMechanism(MechanismText(description, {}), "model").description;
}

constexpr double kTolerance = 1e-12;

/// The last snapshot of a run in tight steps, multipliers at level projection.
Snapshot End(const MechanismDescription& description, double horizon) {
  Method method;
  method.formulation = "lagrange";
  method.enforcement = Enforcement::kPosition;
  const Simulation simulation =
      Simulate(description, method, Options("dormand-prince", kTolerance), horizon);
  EXPECT_EQ(simulation.result.outcome, Outcome::kFinished)
      << description.name << ": " << simulation.result.message;
  return simulation.last;
}

struct Difference {
  double largest = 0.0;  ///< distance of points of the same name at the horizon [m]
  int points = 0;        ///< compared
  int gone = 0;
};

Difference Compare(const MechanismDescription& whole, const Simplified& simplified,
                   double horizon) {
  const Snapshot truth = End(whole, horizon);
  Difference difference;
  std::vector<bool> known;
  std::vector<std::pair<int, std::string>> points;
  for (int b = 1; b < static_cast<int>(whole.bodies.size()); ++b) {
    for (const auto& [point, at] : whole.bodies[b].points) points.emplace_back(b, point);
  }
  known.assign(points.size(), false);
  for (const MechanismDescription& part : simplified.parts) {
    const MechanismDescription model = AsWritten(part);
    const Snapshot end = End(model, horizon);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& [body, point] = points[i];
      const FoundPoint found = FindPoint(model, whole.bodies[body].name, point);
      if (found.body < 0) continue;
      known[i] = true;
      const Eigen::Vector3d here =
          found.body == kGround ? found.at : PointOf(model, end, found.body, found.at);
      const Eigen::Vector3d there =
          PointOf(whole, truth, body, whole.bodies[body].points.at(point));
      difference.largest = std::max(difference.largest, (simplified.R_WC * here - there).norm());
    }
  }
  difference.points = static_cast<int>(std::ranges::count(known, true));
  difference.gone = static_cast<int>(std::ranges::count(known, false));
  return difference;
}

Simplified Apply(const std::string& idea, const MechanismDescription& description,
                 const SimplifyOptions& options = {}, double short_run = 0.0) {
  ShortRun run;
  if (short_run > 0.0) run = MakeShortRun(description, short_run, 60.0);
  Simplified simplified = IdeaOf(idea).apply(description, run, options);
  EXPECT_TRUE(simplified.applies())
      << idea << " of " << description.name << ": " << simplified.why_not;
  return simplified;
}

/// Largest difference of two tight runs of one motion [m]: errors within the tolerance add up over
/// a hundred steps of problems of some metres.
constexpr double kSameMotion = 1e2 * kTolerance;

TEST(SimplifiedModels, ExactOnesMoveAsTheWholeModel) {
  struct Exact {
    std::string idea;
    MechanismDescription whole;
    double horizon;
  };
  const std::vector<Exact> exact = {{"welds", Problem("mechanisms/welded-four-bar"), 2.0},
                                    {"immovable", Problem("mechanisms/truss"), 1.0},
                                    {"islands", Problem("mechanisms/four-islands"), 1.0},
                                    {"planar", Problem("mechanisms/parallelogram-in-space"), 1.0},
                                    {"welds", Model("hall"), 1.0},
                                    {"immovable", Model("hall"), 1.0},
                                    {"islands", Model("hall"), 1.0},
                                    {"welds", Model("excavator-arm"), 1.0},
                                    {"planar", Model("excavator-arm"), 1.0}};
  for (const Exact& one : exact) {
    SCOPED_TRACE(one.idea + " of " + one.whole.name);
    EXPECT_TRUE(IdeaOf(one.idea).is_exact);
    const Difference difference = Compare(one.whole, Apply(one.idea, one.whole), one.horizon);
    EXPECT_LE(difference.largest, kSameMotion);
    EXPECT_GT(difference.points, 0);
    EXPECT_EQ(difference.gone, 0);
  }
}

TEST(SimplifiedModels, TheAssembledStartIsNoOtherMotion) {
  for (const std::string name : {"mechanisms/four-bar", "mechanisms/double-wishbone"}) {
    const MechanismDescription whole = Problem(name);
    std::string why;
    Simplified started;
    started.parts = {WithAssembledStart(whole, &why)};
    ASSERT_EQ(why, "");
    EXPECT_LE(Compare(whole, started, 0.5).largest, kSameMotion) << name;
  }
}

/// Errors of models of a family in which what is neglected gets smaller by ten each time.
template <class Family>
std::vector<double> Errors(const std::string& idea, Family family, double horizon,
                           const SimplifyOptions& options, double short_run = 0.0) {
  std::vector<double> errors;
  for (const double small : {1.0, 0.1, 0.01}) {
    const MechanismDescription whole = family(small);
    errors.push_back(Compare(whole, Apply(idea, whole, options, short_run), horizon).largest);
  }
  return errors;
}

/// Ten times smaller each time: a first-order error, whose second order is a tenth of it at first.
void ExpectFirstOrder(const std::vector<double>& errors) {
  for (std::size_t i = 1; i < errors.size(); ++i) {
    EXPECT_NEAR(std::log10(errors[i - 1] / errors[i]), 1.0, 0.1)
        << errors[i - 1] << " then " << errors[i];
  }
  EXPECT_GT(errors.back(), 10 * kSameMotion) << "round-off has no order";
}

BodyDescription& BodyOf(MechanismDescription* description, const std::string& name) {
  return *std::ranges::find(description->bodies, name, &BodyDescription::name);
}

TEST(SimplifiedModels, TheErrorOfALightLinkIsAsItsMass) {
  const auto with_rod = [](double small) {
    MechanismDescription d = Model("light-rod-compressor");
    BodyDescription& rod = BodyOf(&d, "rod");
    rod.mass *= small;
    rod.inertia *= small;
    return d;
  };
  ExpectFirstOrder(Errors("light-links", with_rod, 1.0, {}));
  // without its mass at the ends the error is larger, and of the same order
  SimplifyOptions lost;
  lost.lumping = Lumping::kNone;
  const std::vector<double> lumped = Errors("light-links", with_rod, 1.0, {});
  const std::vector<double> without = Errors("light-links", with_rod, 1.0, lost);
  ExpectFirstOrder(without);
  for (std::size_t i = 0; i < lumped.size(); ++i) EXPECT_GT(without[i], 2.0 * lumped[i]);
}

TEST(SimplifiedModels, ALinkThatIsTwoLumpsIsExactlyARod) {
  MechanismDescription d = Model("light-rod-compressor");
  BodyDescription& rod = BodyOf(&d, "rod");
  // inertia of two equal lumps at a distance of 0.15 m
  rod.mass = 1.0;
  rod.inertia = Eigen::Matrix3d::Identity() * (0.25 * 0.15 * 0.15);
  SimplifyOptions options;
  options.light_links = 1.0;
  const Simplified simplified = Apply("light-links", d, options);
  EXPECT_LE(Compare(d, simplified, 1.0).largest, kSameMotion);
}

TEST(SimplifiedModels, TheErrorOfAStiffSpringIsAsItsCompliance) {
  const auto with_springs = [](double small) {
    MechanismDescription d = Model("elastic-linkage");
    for (ForceDescription& force : d.forces) {
      if (auto* spring = std::get_if<JointSpring>(&force)) spring->stiffness /= small;
      if (auto* damper = std::get_if<JointDamper>(&force)) damper->damping /= std::sqrt(small);
    }
    return d;
  };
  ExpectFirstOrder(Errors("stiff-springs", with_springs, 0.2, {}));
}

TEST(SimplifiedModels, ASpringBetweenPointsBecomesARod) {
  const auto with_springs = [](double small) {
    MechanismDescription d = Problem("mechanisms/flyball-governor");
    for (ForceDescription& force : d.forces) {
      auto& spring = std::get<SpringDamper>(force);
      spring.stiffness *= 10.0 / small;
      spring.damping /= std::sqrt(small);
    }
    return d;
  };
  const Simplified simplified = Apply("stiff-springs", with_springs(1.0));
  ASSERT_EQ(simplified.parts.front().joints.size(), 6u);
  EXPECT_EQ(simplified.parts.front().joints[4].type, JointType::kRod);
  EXPECT_EQ(simplified.parts.front().joints[4].parameter, 0.5);
  ExpectFirstOrder(Errors("stiff-springs", with_springs, 0.2, {}));
}

TEST(SimplifiedModels, TheErrorOfAConstantPartIsAsItsTravel) {
  const auto on_mounts = [](double small) {
    MechanismDescription d = Model("machine-with-cover");
    for (ForceDescription& force : d.forces) {
      if (auto* spring = std::get_if<JointSpring>(&force)) spring->stiffness /= small;
      if (auto* damper = std::get_if<JointDamper>(&force)) damper->damping /= std::sqrt(small);
    }
    return d;
  };
  // in 0.2 s: the phase of the crank, which the mounts detune, adds up over turns
  const std::vector<double> errors = Errors("constant-parts", on_mounts, 0.2, {}, 0.2);
  for (std::size_t i = 1; i < errors.size(); ++i) EXPECT_LT(errors[i], 0.2 * errors[i - 1]);
}

TEST(SimplifiedModels, TheErrorOfAPlaneIsAsTheTilt) {
  const auto tilted = [](double small) {
    MechanismDescription d = Model("skewed-crank-rocker");
    JointDescription& C = *std::ranges::find(d.joints, "C", &JointDescription::name);
    C.axis = {std::sin(0.02 * small), 0.0, std::cos(0.02 * small)};
    return d;
  };
  ExpectFirstOrder(Errors("nearly-planar", tilted, 0.5, {}));
}

TEST(SimplifiedModels, AHeavyRodIsNoMasslessOne) {
  // twice as heavy as the crank: after a few turns the model is off by a tenth of the crank's arm
  MechanismDescription d = Model("light-rod-compressor");
  BodyDescription& rod = BodyOf(&d, "rod");
  rod.mass = 4.0;
  rod.inertia = Eigen::Matrix3d::Identity() * (4.0 * 0.15 * 0.15 / 12.0);
  const ShortRun none;
  EXPECT_FALSE(IdeaOf("light-links").apply(d, none, {}).applies());
  SimplifyOptions forced;
  forced.light_links = 1.0;
  EXPECT_GT(Compare(d, Apply("light-links", d, forced), 3.0).largest, 0.1 * 0.05);
}

TEST(SimplifiedModels, CombinedOnesHaveTheErrorOfTheirWorst) {
  const MechanismDescription whole = Model("excavator-arm");
  std::vector<const SimplificationRule*> ideas;
  for (const SimplificationRule& idea : SimplificationRules()) ideas.push_back(&idea);
  SimplifyOptions options;
  options.light_links = 0.02;
  const Simplified all = Combine(whole, ideas, MakeShortRun(whole, 1.0, 60.0), options);
  ASSERT_TRUE(all.applies());
  const MechanismDescription& model = all.parts.front();
  EXPECT_EQ(model.space, SpaceKind::kPlanar);
  EXPECT_LT(model.bodies.size(), whole.bodies.size() - 3);
  const Difference difference = Compare(whole, all, 1.0);
  // the link, the only approximation, weighs 6 kg of two tons and turns by less than a radian
  EXPECT_LT(difference.largest, 1e-4);
  EXPECT_GT(difference.largest, kSameMotion);
}

}  // namespace loopbench::harness::reference::simplify_test
