// The paper's formulas, evaluated as printed, against a dense system of the same bodies and against
// O-DCA: random chains closed on Ground (15-42) and figure 4's two loops that share body 2 (43-72),
// through joints of every kind.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "mechanism/description/library.h"
#include "tests/contract/builder.h"
#include "tests/odca/paper_scene.h"

namespace loopbench::odca::paper {
namespace {

using testing::Builder;
using testing::Real;

/// Round-off of sums along n bodies is n eps times the largest term, and what is inverted magnifies
/// it by its condition. Sums within one join have d = 6 terms of random sign, some sqrt(6) eps
/// each, and three products follow one another: 10. The largest deviation seen is 2.
constexpr double kMargin = 10.0;
constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr Real kRealEps = std::numeric_limits<Real>::epsilon();

/// Smallest over largest eigenvalue of what the formulas invert.
double Rcond(const RealMatrix& X) {
  const RealVector eigenvalues = testing::SymmetricEigenvalues(X);
  return static_cast<double>(eigenvalues[0] / eigenvalues[eigenvalues.size() - 1]);
}

/// The largest difference over what is allowed, for quantities of one kind.
struct Deviation {
  Real difference = 0, size = 0;
  void Note(const RealMatrix& a, const RealMatrix& b) {
    difference = std::max(difference, (a - b).cwiseAbs().maxCoeff());
    size = std::max(size, b.cwiseAbs().maxCoeff());
  }
  double Relative() const { return static_cast<double>(difference / size); }
};

Eigen::Vector3d Tip(Builder& b) {
  return b.random.Uniform(0.6, 1.4) * Eigen::Vector3d::UnitX() + b.random.Vector(0.2, b.spatial);
}

/// `count` kinds of joints, at least two of which turn, that leave `least` freedoms or more.
std::vector<JointType> Kinds(Builder& b, int count, int least) {
  for (;;) {
    std::vector<JointType> kinds;
    int freedom = 0, turning = 0;
    while (static_cast<int>(kinds.size()) < count) {
      const auto type = static_cast<JointType>(b.random.Below(kNumJointTypes));
      if (type == JointType::kFree || type == JointType::kRod) continue;
      if (!b.spatial && !ExistsInPlane(type)) continue;
      kinds.push_back(type);
      freedom += NumValues(type, b.description.space, true);
      turning += type != JointType::kPrismatic && type != JointType::kWeld;
    }
    if (freedom >= least && turning >= 2) return kinds;
  }
}

/// Bodies 1..n between two joints to Ground; joint i leads to body i + 1, the last one to Ground.
MechanismDescription ChainOfKinds(int n, SpaceKind space, std::uint64_t seed) {
  Builder b("paper-chain", space, seed);
  const std::vector<JointType> kinds = Kinds(b, n + 1, b.spatial ? 8 : 4);
  for (int i = 0; i < n; ++i) {
    const int body = b.AddBody(1.0);
    b.AddJoint(kinds[i], body - 1, Tip(b), body, b.random.Vector(0.2, b.spatial),
               b.random.Uniform(-2.0, 2.0));
  }
  b.Close(kinds[n], 0, n, Tip(b), b.random.Uniform(-1.0, 1.0));
  return b.Finish();
}

/// Figure 4: Ground, 1, 2, 3, Ground are the upper loop, 2, 4, 5, 6, 2 the lower one. Body 2 has
/// its handle 2+ where the joints to 1 and 4 are, 2- where those to 3 and 6 are; it is Q of all
/// four, so that these points are Mo. The lower loop's joints come first, which lets the plan break
/// its ties so that body 2 meets 4, 5, 6 through both joints at once: the result is `asm`. With one
/// body in place of three it does so with either solver.
struct CoupledLoops {
  int body2 = 1, body1 = 0, body3 = 0;
  std::vector<int> lower;  ///< bodies 4, 5, 6
  /// Indices in the description: of the joints along the lower loop, from 2+ to 2-, and along the
  /// upper one, from Ground to Ground.
  std::vector<int> lower_joints, upper_joints;
  MechanismDescription description;

  CoupledLoops(SpaceKind space, int num_lower, std::uint64_t seed) {
    Builder b("paper-coupled-loops", space, seed);
    const int closed = b.spatial ? 6 : 3;
    const std::vector<JointType> upper = Kinds(b, 4, closed + 1);
    std::vector<JointType> kinds = Kinds(b, num_lower + 1, num_lower > 1 ? closed + 1 : 3);
    // two joints between two bodies: any one with freedom, and a rod
    if (num_lower == 1) kinds.back() = JointType::kRod;
    for (int i = 0; i < num_lower + 3; ++i) b.AddBody(1.0);
    for (int i = 0; i < num_lower; ++i) lower.push_back(2 + i);
    body1 = num_lower + 2;
    body3 = num_lower + 3;
    const Eigen::Vector3d at_first = b.random.Vector(0.2, b.spatial), at_second = Tip(b);
    const auto join = [&](JointType type, int from, const Eigen::Vector3d& at_from, int to,
                          const Eigen::Vector3d& at_to) {
      const int index = b.AddJoint(type, from, at_from, to, at_to, b.random.Uniform(-2.0, 2.0));
      JointDescription& joint = b.description.joints.back();
      if (joint.from.body == body2) std::swap(joint.from, joint.to);
      return index;
    };
    lower_joints.push_back(join(kinds[0], body2, at_first, lower[0], Tip(b)));
    for (int i = 1; i < num_lower; ++i) {
      lower_joints.push_back(
          join(kinds[i], lower[i - 1], Tip(b), lower[i], b.random.Vector(0.2, b.spatial)));
    }
    upper_joints.push_back(join(upper[0], 0, Tip(b), body1, b.random.Vector(0.2, b.spatial)));
    upper_joints.push_back(join(upper[1], body1, Tip(b), body2, at_first));
    upper_joints.push_back(join(upper[2], body2, at_second, body3, Tip(b)));
    const int joints = static_cast<int>(b.description.joints.size());
    upper_joints.push_back(joints);
    lower_joints.push_back(joints + 1);
    b.Close(upper[3], 0, body3, Tip(b), b.random.Uniform(-1.0, 1.0));
    b.Close(kinds[num_lower], lower.back(), body2, at_second, b.random.Uniform(-1.0, 1.0));
    description = b.Finish();
  }
};

/// A series of bodies: its two-handle equations, and forces and accelerations on the way down.
template <class Space>
class Series {
 public:
  /// `bodies` in their order; joint k leads to body k, the last one away from the last body.
  Series(const Scene<Space>& scene, std::vector<int> bodies, std::vector<int> joints)
      : scene_(scene), bodies_(std::move(bodies)), joints_(std::move(joints)) {
    for (std::size_t k = 0; k < bodies_.size(); ++k) {
      handles_.push_back(scene.Body(bodies_[k], joints_[k], joints_[k + 1]));
    }
  }
  /// Puts two-handle equations in the place of a body's own.
  void Replace(int place, const TwoHandles& handles) { handles_[place] = handles; }

  TwoHandles Assembly() { return Assembly(0, static_cast<int>(bodies_.size())); }
  /// Of bodies first .. last - 1, halved again and again.
  TwoHandles Assembly(int first, int last) {
    if (last - first == 1) return handles_[first];
    const int middle = (first + last) / 2;
    const TwoHandles k = Assembly(first, middle), k1 = Assembly(middle, last);
    const SeriesJoin join(k, k1, scene_.JointTo(bodies_[middle], joints_[middle]));
    rcond_ = std::min(rcond_, Rcond(join.X));
    return Assemble(k, k1, join);
  }
  /// Forces on the two handles of the whole given: on each body at its joints.
  void Disassemble(const RealVector& F_first, const RealVector& F_last) {
    inner_.assign(bodies_.size(), {});
    outer_.assign(bodies_.size(), {});
    Disassemble(0, static_cast<int>(bodies_.size()), F_first, F_last);
  }

  const RealVector& inner(int place) const { return inner_[place]; }
  const RealVector& outer(int place) const { return outer_[place]; }
  double rcond() const { return rcond_; }

  /// Forces and accelerations of the bodies but `skipped`, (1-2), against those of the code.
  void Compare(Deviation& forces, Deviation& accelerations, int skipped = -1) const {
    for (std::size_t k = 0; k < bodies_.size(); ++k) {
      if (bodies_[k] == skipped) continue;
      const int body = bodies_[k];
      forces.Note(scene_.ForceOn(body, joints_[k]), inner_[k]);
      forces.Note(scene_.ForceOn(body, joints_[k + 1]), outer_[k]);
      accelerations.Note(scene_.AccelerationAt(body, joints_[k]),
                         handles_[k].A1(inner_[k], outer_[k]));
      accelerations.Note(scene_.AccelerationAt(body, joints_[k + 1]),
                         handles_[k].A2(inner_[k], outer_[k]));
    }
  }

 private:
  void Disassemble(int first, int last, const RealVector& F_first, const RealVector& F_last) {
    if (last - first == 1) {
      inner_[first] = F_first;
      outer_[first] = F_last;
      return;
    }
    const int middle = (first + last) / 2;
    const TwoHandles k = Assembly(first, middle), k1 = Assembly(middle, last);
    const Cut cut = scene_.JointTo(bodies_[middle], joints_[middle]);
    const SeriesJoin join(k, k1, cut);
    const RealVector f = MeasureNumbers(k, k1, cut, join, F_first, F_last);                 // (17)
    const RealVector F = cut.D * f;                                                         // (18)
    const RealVector again = join.W * k.z21 * F_first - join.W * k1.z12 * F_last + join.Y;  // (19)
    const Real size = F.norm() + again.norm() + join.Y.norm(),
               bound = kMargin * kRealEps / Rcond(join.X);
    EXPECT_LE((F - again).norm(), bound * size);
    const RealVector left = cut.D.transpose() * (k1.z11 + k.z22) * F;
    EXPECT_LE(Missing15(k, k1, cut, F_first, F_last, f).norm(),
              bound * (left.norm() + k.z21.norm() * F_first.norm() + k1.z12.norm() * F_last.norm() +
                       k.z23.norm() + k1.z13.norm()));
    Disassemble(first, middle, F_first, -F);
    Disassemble(middle, last, F, F_last);
  }

  const Scene<Space>& scene_;
  std::vector<int> bodies_, joints_;
  std::vector<TwoHandles> handles_;
  std::vector<RealVector> inner_, outer_;
  double rcond_ = 1.0;
};

/// Z of a node over its kept bodies, from the leaves' Z and the V of joins; and all bodies in it.
struct Response {
  std::vector<int> kept, all;
  RealMatrix Z;
  bool grounded = false;
};

template <class Space>
std::vector<Response> Responses(const Odca<Space, double>& odca) {
  constexpr int d = Space::kDim;
  const Joins<Space, double>& joins = odca.sweep().joins();
  const Plan& plan = odca.plan();
  std::vector<Response> responses;
  for (int n = 0; n < plan.num_leaves(); ++n) {
    responses.push_back({{n + 1}, {n + 1}, joins.LeafZ(n).template cast<Real>(), false});
  }
  for (int n = plan.num_leaves(); n < plan.num_nodes(); ++n) {
    const PlanNode& node = plan.nodes()[n - plan.num_leaves()];
    Response response;
    for (const int child : node.children) {
      if (child < 0) continue;
      response.grounded |= responses[child].grounded;
      for (const int body : responses[child].all) response.all.push_back(body);
    }
    for (const NodeJoint& joint : node.joints) response.grounded |= joint.from < 0 || joint.to < 0;
    const int kept = static_cast<int>(node.kept.size());
    response.Z.setZero(d * kept, d * kept);
    for (int e = 0; e < kept; ++e) {
      const Handle& at_e = node.handles[node.kept[e]];
      response.kept.push_back(at_e.body);
      for (int f = 0; f < kept; ++f) {
        const Handle& at_f = node.handles[node.kept[f]];
        auto block = response.Z.block(d * e, d * f, d, d);
        if (at_e.child == at_f.child) {
          block =
              responses[node.children[at_e.child]].Z.block(d * at_e.place, d * at_f.place, d, d);
        }
        const auto* V_e = joins.V(node, n, node.kept[e]);
        const auto* V_f = joins.V(node, n, node.kept[f]);
        for (int i = 0; i < node.rows; ++i) {
          block -= V_e[i].template cast<Real>() * V_f[i].template cast<Real>().transpose();
        }
      }
    }
    std::ranges::sort(response.all);
    responses.push_back(std::move(response));
  }
  return responses;
}

/// How often the code's nodes were found to be the paper's assemblies.
struct Tally {
  int scenes = 0, left_out = 0, assemblies = 0;
  double worst = 0.0;  ///< deviation over its bound
  void Hold(const char* what, const Deviation& deviation, double bound) {
    EXPECT_LE(deviation.Relative(), bound) << what;
    worst = std::max(worst, deviation.Relative() / bound);
  }
  void Print(const char* name) const {
    std::printf("%-26s %d scenes, %d left out, %d assemblies, worst %.2g of the bound\n", name,
                scenes, left_out, assemblies, worst);
  }
};

/// Below this a scene is near a singular position, where numbers say nothing about formulas.
constexpr double kLeastRcond = 1e-5;

/// Upsilon_ij (26-28) of every node that is a series of bodies, at the handles: S_i Z_ij S_j^T.
template <class Space>
void HoldAssemblies(const Scene<Space>& scene, Series<Space>& series, int bodies, double bound,
                    Tally& tally) {
  constexpr int d = Space::kDim;
  Deviation deviation;
  for (const Response& response : Responses(scene.odca())) {
    const int first = response.all.front(), last = response.all.back();
    if (response.grounded || last - first + 1 != static_cast<int>(response.all.size())) continue;
    if (first == last || response.kept.size() != 2 || last > bodies) continue;
    const TwoHandles upsilon = series.Assembly(first - 1, last);
    const int at_first = response.kept[0] == first ? 0 : d, at_last = d - at_first;
    const RealMatrix S1 = scene.Shift(scene.Arm(first, scene.JointIndex(first - 1)));
    const RealMatrix S2 = scene.Shift(scene.Arm(last, scene.JointIndex(last)));
    const auto Z = [&](int i, int j) { return response.Z.block(i, j, d, d); };
    deviation.Note(S1 * Z(at_first, at_first) * S1.transpose(), upsilon.z11);
    deviation.Note(S1 * Z(at_first, at_last) * S2.transpose(), upsilon.z12);
    deviation.Note(S2 * Z(at_last, at_first) * S1.transpose(), upsilon.z21);
    deviation.Note(S2 * Z(at_last, at_last) * S2.transpose(), upsilon.z22);
    ++tally.assemblies;
  }
  if (deviation.size > 0) tally.Hold("Upsilon", deviation, bound);
}

template <class Space>
void HoldChain(const MechanismDescription& description, int n, std::uint64_t seed, Tally& tally) {
  Scene<Space> scene(description, seed);
  std::vector<int> bodies, joints;
  for (int i = 0; i <= n; ++i) joints.push_back(scene.JointIndex(i));
  for (int i = 1; i <= n; ++i) bodies.push_back(i);
  Series<Space> series(scene, bodies, joints);
  // seen from Ground, both joints lead to the system
  const GroundedLoop loop(series.Assembly(), scene.JointTo(1, joints[0]),
                          scene.JointTo(n, joints[n]));
  const double rcond = std::min(series.rcond(), Rcond(loop.chi));
  ++tally.scenes;
  if (!(rcond > kLeastRcond)) {
    ++tally.left_out;
    return;
  }
  series.Disassemble(loop.F_bb, loop.F_tb);
  const DenseAnswer dense = scene.Solve(bodies, joints, RealVector::Zero(Space::kDim));
  Deviation printed;
  for (int i = 0; i < n; ++i) {
    const bool is_Q = scene.mechanism().joints()[joints[i]].to == bodies[i];
    printed.Note(is_Q ? series.inner(i) : RealVector(-series.inner(i)), dense.forces[i]);
  }
  tally.Hold("printed against dense", printed, static_cast<double>(kMargin * n * kRealEps) / rcond);
  EXPECT_LE(loop.missing37.norm() + loop.missing38.norm(),
            kMargin * n * kRealEps / rcond * (loop.chi.norm() * printed.size + 1));

  const double bound = kMargin * n * kEps / rcond;
  for (const SolverKind solver : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
    ASSERT_EQ(scene.Evaluate(solver), Outcome::kFinished) << description.name;
    Deviation forces, accelerations;
    series.Compare(forces, accelerations);
    tally.Hold("forces", forces, bound);
    tally.Hold("accelerations", accelerations, bound);
    HoldAssemblies(scene, series, n, bound, tally);
  }
}

TEST(PaperTest, ChainsClosedOnGroundInThePlane) {
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    for (const int n : {3, 5, 8}) {
      HoldChain<Planar>(ChainOfKinds(n, SpaceKind::kPlanar, seed), n, seed, tally);
    }
  }
  tally.Print("plane, chains");
  EXPECT_LE(3 * tally.left_out, tally.scenes);
  EXPECT_GE(tally.assemblies, tally.scenes);
}

TEST(PaperTest, ChainsClosedOnGroundInSpace) {
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    for (const int n : {4, 7}) {
      HoldChain<Spatial>(ChainOfKinds(n, SpaceKind::kSpatial, seed), n, seed, tally);
    }
  }
  tally.Print("space, chains");
  EXPECT_LE(3 * tally.left_out, tally.scenes);
  EXPECT_GE(tally.assemblies, tally.scenes);
}

/// The two loops in a scene, and the lower one in the paper's letters.
template <class Space>
struct PaperLoops {
  const CoupledLoops loops;
  Scene<Space> scene;
  std::vector<int> lower_joints, upper_joints;  ///< of the mechanism
  Series<Space> lower;
  TwoHandles sys, body2;
  Cut j4, j6;
  CoupledLoop coupled;

  PaperLoops(int num_lower, std::uint64_t seed)
      : loops(Space::kRot == 1 ? SpaceKind::kPlanar : SpaceKind::kSpatial, num_lower, seed),
        scene(loops.description, seed),
        lower_joints(Indices(loops.lower_joints)),
        upper_joints(Indices(loops.upper_joints)),
        lower(scene, loops.lower, lower_joints),
        sys(lower.Assembly()),
        body2(scene.Body(loops.body2, lower_joints.front(), lower_joints.back())),
        j4(scene.JointTo(loops.lower.front(), lower_joints.front())),
        j6(scene.JointTo(loops.lower.back(), lower_joints.back())),
        coupled(body2, sys, j4, j6) {}

  double rcond() const { return std::min(lower.rcond(), Rcond(coupled.X)); }
  /// Takes a motion of body 2 to both its handles.
  RealMatrix ShiftToHandles() const {
    RealMatrix S(2 * Space::kDim, Space::kDim);
    S << scene.Shift(scene.Arm(loops.body2, lower_joints.front())),
        scene.Shift(scene.Arm(loops.body2, lower_joints.back()));
    return S;
  }

 private:
  std::vector<int> Indices(std::vector<int> joints) const {
    for (int& joint : joints) joint = scene.JointIndex(joint);
    return joints;
  }
};

/// The paper's steps: 4, 5, 6 in series; with body 2 into `asm`; 1, asm, 3 in series, closed on
/// Ground; and down again.
template <class Space>
void HoldCoupledLoops(int num_lower, std::uint64_t seed, Tally& tally) {
  constexpr int d = Space::kDim;
  PaperLoops<Space> p(num_lower, seed);
  Series<Space> upper(p.scene, {p.loops.body1, p.loops.body2, p.loops.body3}, p.upper_joints);
  upper.Replace(1, p.coupled.Asm());
  const GroundedLoop loop(upper.Assembly(), p.scene.JointTo(p.loops.body1, p.upper_joints.front()),
                          p.scene.JointTo(p.loops.body3, p.upper_joints.back()));
  const double rcond = std::min({p.rcond(), upper.rcond(), Rcond(loop.chi)});
  ++tally.scenes;
  if (!(rcond > kLeastRcond)) {
    ++tally.left_out;
    return;
  }
  upper.Disassemble(loop.F_bb, loop.F_tb);
  RealVector F_ext(2 * d);
  F_ext << upper.inner(1), upper.outer(1);
  const RealVector F = p.coupled.Force(F_ext);
  p.lower.Disassemble(F.head(d), F.tail(d));
  EXPECT_LE(Missing57And58(p.body2, p.sys, p.j4, p.j6, F_ext, F).norm(),
            kMargin * kRealEps / rcond * (1 + p.coupled.zeta2.norm()) * (F.norm() + F_ext.norm()));

  const double bound = kMargin * (num_lower + 3) * kEps / rcond;
  const RealMatrix S = p.ShiftToHandles();
  for (const SolverKind solver : {SolverKind::kAsPublished, SolverKind::kRankRevealing}) {
    ASSERT_EQ(p.scene.Evaluate(solver), Outcome::kFinished) << seed;
    Deviation forces, accelerations, asms;
    p.lower.Compare(forces, accelerations);
    upper.Compare(forces, accelerations);
    tally.Hold("forces", forces, bound);
    tally.Hold("accelerations", accelerations, bound);
    for (const Response& response : Responses(p.scene.odca())) {
      if (response.all.size() != p.loops.lower.size() + 1 || response.grounded) continue;
      if (response.kept != std::vector<int>{p.loops.body2}) continue;
      asms.Note(S * response.Z * S.transpose(), p.coupled.ZetaAsm());
      ++tally.assemblies;
    }
    if (asms.size > 0) tally.Hold("zeta asm", asms, bound);
  }
}

template <class Space>
void HoldCoupledLoops(const char* name) {
  Tally three, one;
  for (std::uint64_t seed = 1; seed <= 16; ++seed) {
    HoldCoupledLoops<Space>(3, seed, three);
    HoldCoupledLoops<Space>(1, seed, one);
  }
  three.Print((std::string(name) + ", lower loop of 3").c_str());
  one.Print((std::string(name) + ", lower loop of 1").c_str());
  EXPECT_LE(3 * three.left_out, three.scenes);
  EXPECT_LE(3 * one.left_out, one.scenes);
  EXPECT_GE(three.assemblies, three.scenes - three.left_out) << "asm of each scene, as published";
  EXPECT_EQ(one.assemblies, 2 * (one.scenes - one.left_out))
      << "asm of each scene, by both solvers";
}

TEST(PaperTest, LoopsThatShareABodyInThePlane) { HoldCoupledLoops<Planar>("plane"); }

TEST(PaperTest, LoopsThatShareABodyInSpace) { HoldCoupledLoops<Spatial>("space"); }

/// The bodies 2, 4, 5, 6 alone, body 2 with random forces at its handles, as one dense system.
template <class Space>
void HoldMisprint(std::uint64_t seed, Tally& tally) {
  constexpr int d = Space::kDim;
  const PaperLoops<Space> p(3, seed);
  ++tally.scenes;
  if (!(p.rcond() > kLeastRcond)) {
    ++tally.left_out;
    return;
  }
  testing::Random random(seed + 99);
  RealVector F_ext(2 * d), n(2 * d);
  for (int i = 0; i < 2 * d; ++i) F_ext[i] = random.Uniform(-5.0, 5.0);
  const RealMatrix S = p.ShiftToHandles();
  const int body2 = p.loops.body2;
  const std::vector<int> bodies = {body2, p.loops.lower[0], p.loops.lower[1], p.loops.lower[2]};
  const DenseAnswer dense = p.scene.Solve(bodies, p.lower_joints, S.transpose() * F_ext);
  n << p.scene.Centripetal(body2, p.scene.Arm(body2, p.lower_joints.front())),
      p.scene.Centripetal(body2, p.scene.Arm(body2, p.lower_joints.back()));
  const RealVector A = S * dense.accelerations[0] + n;
  Deviation with_factor, as_printed;
  with_factor.Note(p.coupled.ZetaAsm() * F_ext + p.coupled.ZetaAsm3(), A);  // (70)
  as_printed.Note(p.coupled.ZetaAsm() * F_ext + p.coupled.ZetaAsm3AsPrinted(), A);
  tally.Hold("(72) with the factor zeta", with_factor,
             static_cast<double>(kMargin * 4 * kRealEps) / p.rcond());
  EXPECT_GE(as_printed.Relative(), 1e-3) << "as printed";
}

TEST(PaperTest, Equation72LacksAFactorInPrint) {
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    HoldMisprint<Planar>(seed, tally);
    HoldMisprint<Spatial>(seed, tally);
  }
  tally.Print("(72) with its factor");
  EXPECT_LE(3 * tally.left_out, tally.scenes);
}

/// Section 3.3 says that all matrices stay positive definite. Those of joins with a floating side
/// do; chi of a planar loop has three zero eigenvalues in space, in every position.
TEST(PaperTest, ChiOfAPlanarLoopInSpaceIsNotPositiveDefinite) {
  MechanismDescription description = Chain(3);
  description.space = SpaceKind::kSpatial;
  const int n = static_cast<int>(description.bodies.size()) - 1;
  const Scene<Spatial> scene(description, 1);
  std::vector<int> bodies, joints;
  for (int i = 0; i <= n; ++i) joints.push_back(scene.JointIndex(i));
  for (int i = 1; i <= n; ++i) bodies.push_back(i);
  Series<Spatial> series(scene, bodies, joints);
  const GroundedLoop loop(series.Assembly(), scene.JointTo(1, joints[0]),
                          scene.JointTo(n, joints[n]));
  EXPECT_GE(series.rcond(), 1e-3);
  const RealVector eigenvalues = testing::SymmetricEigenvalues(loop.chi);
  const Real largest = eigenvalues[eigenvalues.size() - 1];
  ASSERT_EQ(eigenvalues.size(), 10);
  for (int i = 0; i < 3; ++i) EXPECT_LE(std::abs(eigenvalues[i]), 1e-14L * largest) << i;
  EXPECT_GE(eigenvalues[3], 1e-4L * largest);
}

}  // namespace
}  // namespace loopbench::odca::paper
