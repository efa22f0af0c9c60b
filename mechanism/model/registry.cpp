#include "mechanism/model/registry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "mechanism/description/registration.h"

namespace loopbench {
namespace {

/// Checks that a kind's functions agree with one another in one space. They are evaluated at a few
/// coordinates near one: differences above kRound are errors, not rounding.
template <class Space>
class KindCheck {
 public:
  KindCheck(const JointTraits& traits, const JointKind<Space, double>& kind,
            const JointKind<Space, Dual>& dual)
      : traits_(traits), kind_(kind), dual_(dual) {
    if (traits.parameter.key.empty()) return;
    kind_.parameter = 0.3;
    dual_.parameter = Dual(0.3);
  }

  /// Returns the error, or "".
  std::string Find() {
    if (std::string wrong = Sizes(); !wrong.empty()) return wrong;
    for (int sample = 0; sample < 5 && wrong_.empty(); ++sample) At(sample);
    return wrong_;
  }

 private:
  static constexpr double kRound = 1e-12;
  static constexpr int kMaxCoordinates = 7;

  std::string Sizes() const {
    const int q = kind_.num_q, u = kind_.num_u;
    if (!kind_.transform || !kind_.coordinates || !kind_.rates || !dual_.transform ||
        !dual_.coordinates || !dual_.rates) {
      return "no transform, coordinates or rates";
    }
    if (u < 0 || u > Space::kDim || q > kMaxCoordinates || (q != u && (q != u + 1 || q < 4))) {
      return "numbers of coordinates and speeds that differ by other than a quaternion";
    }
    const SpaceKind space = Space::kRot == 3 ? SpaceKind::kSpatial : SpaceKind::kPlanar;
    const auto coordinates = ValueWords(traits_, space, false);
    const auto speeds = ValueWords(traits_, space, true);
    const auto lengths = [](const auto& words) {
      return std::ranges::count_if(words, &ValueWord::is_length);
    };
    if (std::ssize(coordinates) != q || std::ssize(speeds) != u ||
        lengths(coordinates) != lengths(speeds)) {
      return "other coordinates and speeds than its traits name";
    }
    for (int i = 0; i < u && kind_.basis == nullptr; ++i) {
      if (speeds[i].is_length() != (kind_.axes[i] >= Space::kRot)) {
        return "an angle among its axes where its traits name a length, or the other way";
      }
    }
    auto axes = kind_.axes;
    std::ranges::sort(axes);
    for (int i = 0; i < Space::kDim; ++i) {
      if (axes[i] != i) return "axes that are not each axis once";
    }
    return "";
  }

  void Expect(bool holds, const char* what) {
    if (!holds && wrong_.empty()) wrong_ = what;
  }

  template <class S>
  static Basis<Space, S> BasisAt(const JointKind<Space, S>& kind, const Pose<Space, S>& X) {
    Basis<Space, S> basis;
    if (kind.basis != nullptr) {
      kind.basis(X, basis, kind.parameter);
    } else {
      for (int i = 0; i < Space::kDim; ++i) basis[i] = Direction<Space, S>::Unit(kind.axes[i]);
    }
    return basis;
  }

  void At(int sample) {
    double q[kMaxCoordinates + 1], u[Space::kDim + 1], qdot[kMaxCoordinates + 1];
    double length = 0.0;
    for (int i = 0; i < kind_.num_q; ++i) q[i] = std::sin(1.7 * (i + 1) + 0.9 * sample);
    for (int i = 0; i < 4; ++i) length += kind_.has_quaternion() ? q[i] * q[i] : 0.25;
    for (int i = 0; i < 4 && kind_.has_quaternion(); ++i) q[i] /= std::sqrt(length);
    for (int k = 0; k < kind_.num_u; ++k) u[k] = std::cos(2.3 * k + sample);

    // derivatives along each speed by itself
    Dual along[kMaxCoordinates + 1];
    for (int i = 0; i < kind_.num_q; ++i) along[i] = Dual(q[i]);
    for (int k = 0; k < kind_.num_u; ++k) {
      double unit[Space::kDim + 1] = {};
      unit[k] = 1.0;
      kind_.rates(q, unit, qdot);
      for (int i = 0; i < kind_.num_q; ++i) along[i].SetPartial(k, qdot[i]);
    }
    const Pose<Space, Dual> moving = PoseAt(dual_, along);
    const Pose<Space, double> X = PoseAt(kind_, q);
    const Basis<Space, double> basis = BasisAt(kind_, X);
    Orthogonal(basis);
    Motions(basis, moving);
    Rates(basis, X, BasisAt(dual_, moving), u);
    Nearest(X);
    if (kind_.rotation_invariant) Invariant(basis);
  }

  void Orthogonal(const Basis<Space, double>& basis) {
    const double first = kind_.num_u > 0 ? basis[0].squaredNorm() : 1.0;
    for (int i = 0; i < Space::kDim; ++i) {
      for (int j = 0; j < Space::kDim; ++j) {
        const double square = i != j ? 0.0 : i < kind_.num_u ? first : 1.0;
        Expect(std::abs(basis[i].dot(basis[j]) - square) <= kRound,
               "directions [H D] that are not orthogonal, those of D of length one and those of H "
               "of one length");
      }
    }
  }

  /// Checks that each column of H is the motion of M in F along its speed.
  void Motions(const Basis<Space, double>& basis, const Pose<Space, Dual>& X) {
    for (int k = 0; k < kind_.num_u; ++k) {
      const auto turn = [&](int i, int j) {
        double sum = 0.0;
        for (int c = 0; c < Space::kLin; ++c) sum += X.R(i, c).partial(k) * X.R(j, c).value;
        return sum;
      };
      Direction<Space, double> motion;
      if constexpr (Space::kRot == 1) {
        motion.angular[0] = turn(1, 0);
      } else {
        motion.angular = {turn(2, 1), turn(0, 2), turn(1, 0)};
      }
      for (int i = 0; i < Space::kLin; ++i) motion.linear[i] = X.p[i].partial(k);
      Expect((motion - basis[k]).norm() <= kRound,
             "a column of H that is not the derivative of the transform along its speed");
    }
  }

  /// The bias is the derivative of H u along u.
  void Rates(const Basis<Space, double>& basis, const Pose<Space, double>& X,
             const Basis<Space, Dual>& moving, const double* u) {
    Velocity<Space, double> V(Angular<Space, double>::Zero(), Linear<Space, double>::Zero());
    Acceleration<Space, double> rate(V.angular, V.linear);
    for (int j = 0; j < kind_.num_u; ++j) {
      V += basis[j] * u[j];
      for (int k = 0; k < kind_.num_u; ++k) {
        for (int i = 0; i < Space::kDim; ++i) rate[i] += moving[j][i].partial(k) * u[j] * u[k];
      }
    }
    if (kind_.bias != nullptr) rate -= kind_.bias(X, V);
    Expect(rate.norm() <= kRound, "a bias that is not the derivative of H u");
  }

  void Nearest(const Pose<Space, double>& X) {
    Expect(Mismatch(kind_, X).norm() <= kRound,
           "an admissible pose that `coordinates` does not give back");
  }

  /// D stays across H when D is turned and H is not.
  void Invariant(const Basis<Space, double>& basis) {
    Rotation<Space, double> R;
    if constexpr (Space::kRot == 1) {
      R = {0.8, -0.6, 0.6, 0.8};
    } else {
      const double quaternion[] = {0.5, 0.1, -0.7, 0.5};
      R = FromQuaternion(quaternion);
    }
    for (int r = kind_.num_u; r < Space::kDim; ++r) {
      Direction<Space, double> turned(basis[r].angular, R * basis[r].linear);
      if constexpr (Space::kRot == 3) turned.angular = R * basis[r].angular;
      for (int k = 0; k < kind_.num_u; ++k) {
        Expect(std::abs(turned.dot(basis[k])) <= kRound,
               "rotation_invariant, though rotations of F change D");
      }
    }
  }

  JointTraits traits_;
  JointKind<Space, double> kind_;
  JointKind<Space, Dual> dual_;
  std::string wrong_;
};

template <class Space>
void CheckKind(const JointTraits& traits, const JointKind<Space, double>& kind,
               const JointKind<Space, Dual>& dual) {
  const std::string wrong = KindCheck<Space>(traits, kind, dual).Find();
  if (wrong.empty()) return;
  RefuseRow("joint kind", traits.name, wrong + (Space::kRot == 3 ? " in space" : " in the plane"),
            "what mechanism/model/joint.h says of it");
}

}  // namespace

JointType RegisterJoint(const JointTraits& traits, const JointKindSet& kinds, int alignment) {
  RequireSound(
      {.kind = "joint kind",
       .name = traits.name,
       .is_taken = std::ranges::count(AllJointTraits(), traits.name, &JointTraits::name) > 0,
       .alignment = alignment});
  CheckKind(traits, kinds.spatial, kinds.spatial_dual);
  if (traits.in_plane) CheckKind(traits, kinds.planar, kinds.planar_dual);
  const JointType type = AddJointTraits(traits);
  AddKind(type, kinds.planar);
  AddKind(type, kinds.planar_dual);
  AddKind(type, kinds.spatial);
  AddKind(type, kinds.spatial_dual);
  return type;
}

void RegisterForce(OtherForce force, int alignment) {
  const ForceParts parts = PartsOf(force);
  const auto refuse = [&](const std::string& found, std::string_view expected) {
    RefuseRow("force", parts.name, found, expected);
  };
  const auto has_this_name = [&](ForceDescription other) {
    return PartsOf(other).name == parts.name;
  };
  RequireSound({.kind = "force",
                .name = parts.name,
                .is_taken = std::ranges::any_of(ForceKinds(), has_this_name),
                .has_sentence = !parts.sentence.empty(),
                .alignment = alignment});
  if (parts.points.size() > 2 || (parts.joint == nullptr) == parts.points.empty()) {
    refuse(std::to_string(parts.points.size()) + " points" + (parts.joint ? " and a joint" : ""),
           "a joint, a point of a body, or two points");
  }
  if ((parts.force == nullptr) != (parts.in_body_axes == nullptr)) {
    refuse("one of a vector and its axes", "both or none");
  }
  for (const ForceNumber& number : parts.numbers) {
    if (number.key.empty() || number.value == nullptr) {
      refuse("a number \"" + std::string(number.key) + "\" without key or value", "both");
    }
  }
  AddForceKind(std::move(force));
}

}  // namespace loopbench
