// Series of bodies in the paper's formulas, held against what O-DCA found: shared by the tests of
// chains and of coupled loops.
#pragma once

#include "tests/contract/builder.h"
#include "tests/odca/paper_scene.h"

namespace loopbench::odca::paper {

using testing::Builder;
using testing::Real;

/// Round-off of sums along n bodies is n eps times the largest term, and what is inverted magnifies
/// it by its condition. Sums within one join have d = 6 terms of random sign, some sqrt(6) eps
/// each, and three products follow one another: 10. The largest deviation seen is 2.
inline constexpr double kMargin = 10.0;
inline constexpr Real kRealEps = std::numeric_limits<Real>::epsilon();

/// Smallest over largest eigenvalue of what the formulas invert.
inline double Rcond(const RealMatrix& X) {
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

/// Where a bar of about a metre meets the next one.
inline Eigen::Vector3d Tip(Builder& b) {
  return b.random.Uniform(0.6, 1.4) * Eigen::Vector3d::UnitX() + b.random.Vector(0.2, b.spatial);
}

/// `count` kinds of joints, at least two of which turn, that leave `least` freedoms or more.
inline std::vector<JointType> Kinds(Builder& b, int count, int least) {
  for (;;) {
    std::vector<JointType> kinds;
    int freedom = 0, turning = 0;
    while (static_cast<int>(kinds.size()) < count) {
      const JointType type = testing::DrawKind(b.random);
      if (type == JointType::kFree || type == JointType::kRod) continue;
      if (!b.spatial && !TraitsOf(type).in_plane) continue;
      kinds.push_back(type);
      freedom += NumValues(type, b.description.space, true);
      turning += type != JointType::kPrismatic && type != JointType::kWeld;
    }
    if (freedom >= least && turning >= 2) return kinds;
  }
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
    std::printf("%-26s %d problems, %d left out, %d assemblies, worst %.2g of the bound\n", name,
                scenes, left_out, assemblies, worst);
  }
};

/// Below this a scene is near a singular position, where numbers say nothing about formulas.
inline constexpr double kMinRcond = 1e-5;

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
  /// Returns the assembly of bodies first .. last - 1, by halves.
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
  const Sweep<Space, double>& sweep = odca.sweep();
  const Plan& plan = odca.plan();
  std::vector<Response> responses;
  for (int n = 0; n < plan.num_leaves(); ++n) {
    RealMatrix Z(d, d);
    for (int k = 0; k < d; ++k) {
      const auto unit = Wrench<Space, double>::Unit(k);
      Z.col(k) = sweep.Response(n, unit).eigen().template cast<Real>();
    }
    responses.push_back({{n + 1}, {n + 1}, Z, false});
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
          block = responses[node.children[at_e.child]].Z.block(at_e.place, at_f.place, d, d);
        }
        const auto V = [&](const Handle& handle) {
          using RowByRow = Eigen::Matrix<double, Eigen::Dynamic, d, Eigen::RowMajor>;
          return RealMatrix(Eigen::Map<const RowByRow>(sweep.V(node, n, handle), node.rows, d)
                                .template cast<Real>());
        };
        block -= V(at_e).transpose() * V(at_f);
      }
    }
    std::ranges::sort(response.all);
    responses.push_back(std::move(response));
  }
  return responses;
}

/// Bodies 1..n between two joints to Ground; joint i leads to body i + 1, the last one to Ground.
inline MechanismDescription ChainOf(const std::vector<JointType>& kinds, Builder& b) {
  const int n = static_cast<int>(kinds.size()) - 1;
  for (int i = 0; i < n; ++i) {
    const int body = b.AddBody(1.0);
    b.AddJoint(kinds[i], body - 1, Tip(b), body, b.random.Vector(0.2, b.spatial),
               b.random.Uniform(-2.0, 2.0));
  }
  b.Close(kinds[n], 0, n, Tip(b), b.random.Uniform(-1.0, 1.0));
  return b.Finish();
}

}  // namespace loopbench::odca::paper
