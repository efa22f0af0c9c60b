// Exported MJCF, loaded from its file by MuJoCo itself: bodies, joints and forces to round-off,
// closures closed, and accelerations as far as MuJoCo's closures are soft.
#include "harness/exchange/export_mjcf.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <filesystem>

#include "harness/base/text.h"
#include "harness/exchange/export_names.h"
#include "harness/exchange/model.h"
#include "mechanism/description/library.h"
#include "tests/peers/at_start.h"
#include "tests/peers/expressible.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace peers_export_mjcf_test {

using exchange::Unsupported;
using peers_test::AtStart;
using peers_test::kEps;
using peers_test::Largest;
using peers_test::LargestDifference;

const exchange::ExportFormat& kMjcf = exchange::ExportFormats().front();

/// A file as MuJoCo has it, at its keyframe.
class Loaded {
 public:
  explicit Loaded(const std::filesystem::path& path) {
    char error[500] = "";
    model_ = mj_loadXML(path.c_str(), nullptr, error, sizeof error);
    if (model_ == nullptr) throw std::runtime_error(error);
    data_ = mj_makeData(model_);
    mj_resetDataKeyframe(model_, data_, mj_name2id(model_, mjOBJ_KEY, "start"));
    mj_forward(model_, data_);
  }
  ~Loaded() {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  Loaded(const Loaded&) = delete;
  Loaded& operator=(const Loaded&) = delete;

  mjModel& model() { return *model_; }
  mjData& data() { return *data_; }

  /// Accelerations in our coordinates.
  std::vector<double> Udot(const exchange::Model& ours, const exchange::Mjcf& made) const {
    std::vector<double> udot(static_cast<std::size_t>(ours.num_u));
    for (int j = 0; j < model_->njnt; ++j) {
      const exchange::MjcfCoordinate& one = made.coordinates.at(static_cast<std::size_t>(j));
      const double* own = data_->qacc + model_->jnt_dofadr[j];
      const auto u = static_cast<std::size_t>(one.u);
      if (!one.ball) {
        udot[u] = one.sign * own[0];
        continue;
      }
      double w[3];  // in axes of the moved joint frame
      mju_rotVecMatT(w, own, one.axes.data());
      if (one.sign > 0.0) {
        double turn[4];  // a state's quaternion may have any length
        mju_copy(turn, ours.q.data() + one.q, 4);
        mju_normalize4(turn);
        mju_rotVecQuat(&udot[u], w, turn);
      } else {
        for (std::size_t i = 0; i < 3; ++i) udot[u + i] = -w[i];
      }
    }
    return udot;
  }

 private:
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
};

std::filesystem::path Write(const std::string& name, const std::string& text) {
  const auto path = std::filesystem::path(::testing::TempDir()) / ("exported-" + name + ".xml");
  WriteFileAtomically(path, text);
  return path;
}

/// Names of the mechanism lead to MuJoCo's bodies, which are where ours are.
void ExpectBodies(const AtStart& ours, Loaded& loaded) {
  EXPECT_EQ(static_cast<std::size_t>(loaded.model().nbody), ours.origins.size() + 1);
  for (const auto& [name, origin] : ours.origins) {
    const int body = mj_name2id(&loaded.model(), mjOBJ_BODY, name.c_str());
    ASSERT_GE(body, 0) << name;
    const Eigen::Map<const Eigen::Vector3d> at(loaded.data().xpos + 3 * body);
    // some ten products of rounded frames from Ground to the body
    const double size = std::max(ours.length, origin.cwiseAbs().maxCoeff());
    EXPECT_LE((at - origin).cwiseAbs().maxCoeff(), 100 * kEps * size) << name;
  }
}

class ShippedMjcf : public ::testing::TestWithParam<std::string> {};

TEST_P(ShippedMjcf, HasOurAccelerationsAtTheStart) {
  const MechanismDescription description = reference::Shipped(GetParam()).description;
  std::string text;
  try {
    text = exchange::Export(description, kMjcf).text;
  } catch (const Unsupported& missing) {
    // the command says so (tests/harness/export_test.cpp)
    EXPECT_TRUE(GetParam() == "driven-four-bar" || GetParam() == "screw-jack") << missing.what();
    return;
  }
  const AtStart ours = peers_test::LoopbenchInitialState(description);
  Loaded loaded(Write(GetParam(), text));
  ExpectBodies(ours, loaded);
  const exchange::Model model = exchange::MakeModelAtStart(description);
  const exchange::Mjcf made = exchange::MakeMjcf(model);
  ASSERT_EQ(static_cast<std::size_t>(loaded.model().njnt), made.coordinates.size());

  const std::vector<double> theirs = loaded.Udot(model, made);
  double open = 0.0, moving = 0.0;
  for (int i = 0; i < loaded.data().nefc; ++i) {
    open = std::max(open, std::abs(loaded.data().efc_pos[i]));
    moving = std::max(moving, std::abs(loaded.data().efc_vel[i]));
  }
  loaded.model().opt.disableflags |= mjDSBL_EQUALITY;
  mj_forward(&loaded.model(), &loaded.data());
  const std::vector<double> theirs_open = loaded.Udot(model, made);

  const double open_error = LargestDifference(theirs_open, ours.udot_open);
  EXPECT_LE(open_error, ours.bound_open);
  // the tree puts closures where the start's residual and some ten rounded frames leave them
  const double size = ours.length;
  EXPECT_LE(open, 2 * ours.position_residual + 100 * kEps * size);
  EXPECT_LE(moving, 2 * ours.speed_residual + 100 * kEps * size * Largest(ours.u));
  // MuJoCo leaves a share of 1e-4 of a closure's acceleration unopposed, by a mean of the inertia
  // that its row meets, which is a few times the true one
  const double by_loops = LargestDifference(ours.udot_open, ours.udot_without_bias);
  const double soft = LargestDifference(theirs, ours.udot_without_bias);
  EXPECT_LE(soft, 10 * 1e-4 * by_loops + ours.bound);
  // for results/peers/exports.md
  const auto record = [&](const char* key, double difference) {
    RecordProperty(key, fmt::format("{:.1e}", difference / ours.Scale()));
  };
  record("tree", open_error);
  record("closures", soft);
  record("all", LargestDifference(theirs, ours.udot));
}

INSTANTIATE_TEST_SUITE_P(All, ShippedMjcf, ::testing::ValuesIn(reference::ShippedNames()),
                         [](const auto& name) { return reference::WithoutDashes(name.param); });

/// Trees of joints of these kinds, reversed ones among them, put at random coordinates, with forces
/// of every kind; how many of them MuJoCo has.
template <class Space>
int CompareTrees(SpaceKind space, testing::DrawnKinds kinds = testing::DrawnKinds::kUpToHelical) {
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    MechanismDescription tree = testing::AnyMechanism(6, 0, 0, space, seed, kinds);
    testing::KeepExpressible(tree);
    testing::AddConstantForces(tree, true);
    const testing::Sample<Space> sample(tree, seed);
    const auto& state = sample.state(Coordinates::kJoint);
    exchange::Model model = exchange::MakeModel(tree);
    model.q.assign(state.q.begin(), state.q.end());
    model.u.assign(state.u.begin(), state.u.end());
    try {
      const exchange::Mjcf made = exchange::MakeMjcf(model);
      const std::vector<double> udot = Loaded(Write("tree", made.document)).Udot(model, made);
      const VectorX<double> theirs = Eigen::Map<const VectorX<double>>(udot.data(), state.u.size());
      EXPECT_LE(testing::RelativeError(theirs, sample.udot(Coordinates::kJoint)), sample.Bound())
          << tree.name;
      ++compared;
    } catch (const Unsupported& missing) {
      EXPECT_NE(std::string(missing.what()).find("helical"), std::string::npos) << missing.what();
    }
  }
  return compared;
}

TEST(ExportedMjcf, OfTreesAtAnyCoordinatesHasTheOraclesAccelerations) {
  EXPECT_EQ(CompareTrees<Planar>(SpaceKind::kPlanar), 40);
  EXPECT_GE(CompareTrees<Spatial>(SpaceKind::kSpatial), 12);  // others have helical joints
  EXPECT_GE(CompareTrees<Spatial>(SpaceKind::kSpatial, testing::DrawnKinds::kAll), 12);
}

TEST(ExportedMjcf, IsLoadedAsDeepAsItIsWritten) {
  for (const int bodies : {90, 91}) {
    MechanismDescription chain = Tree(bodies, 0.0);  // each bar below the one before
    for (int i = 1; i < bodies; ++i) chain.joints[static_cast<std::size_t>(i)].from.body = i;
    if (bodies == 91) {
      EXPECT_THROW(exchange::Export(chain, kMjcf), Unsupported);
    } else {
      EXPECT_EQ(Loaded(Write("deep", exchange::Export(chain, kMjcf).text)).model().nbody, 91);
    }
  }
}

TEST(ExportedMjcf, HasNamesThatAreOnlyNames) {
  std::vector<std::string> names;
  const MechanismDescription mechanism =
      peers_test::HostileLadder("--><mujoco/>]]>\n<!-- \?\?/", &names);
  const exchange::ExportedFile file = exchange::Export(mechanism, kMjcf);
  Loaded loaded(Write("hostile", file.text));
  EXPECT_EQ(static_cast<std::size_t>(loaded.model().nbody), mechanism.bodies.size());
  for (std::size_t i = 1; i < mechanism.bodies.size(); ++i) {
    std::string name = exchange::XmlText(names[i - 1]);
    if (name == "world") name += "_2";  // MuJoCo's own
    EXPECT_GE(mj_name2id(&loaded.model(), mjOBJ_BODY, name.c_str()), 0) << name;
    const std::string point = names[i - 1] + "." + names[i];
    EXPECT_GE(mj_name2id(&loaded.model(), mjOBJ_SITE, exchange::XmlText(point).c_str()), 0)
        << point;
    // what is called otherwise is said
    const bool said = std::ranges::any_of(file.notes, [&](const exchange::Note& note) {
      return note.text == fmt::format("body \"{}\" is called \"{}\".", names[i - 1], name);
    });
    EXPECT_EQ(said, name != names[i - 1]) << name;
  }
}

}  // namespace peers_export_mjcf_test
}  // namespace loopbench::harness
