#include "mechanism/loops/joint_response.h"

#include <algorithm>
#include <limits>

#include "mechanism/algebra/known_size.h"
#include "mechanism/loops/loop_solver.h"

namespace loopbench {

template <class Space>
std::unique_ptr<JointResponse<Space>> JointResponse<Space>::Make(
    const Mechanism<Space, double>& mechanism, double most) {
  std::vector<Side> sides;
  std::vector<int> rows, joints;
  std::vector<std::vector<int>> sides_of_body(mechanism.num_bodies());
  int first = 0, row = 0;
  for (int j = 0; j < static_cast<int>(mechanism.joints().size()); ++j) {
    const Joint<Space, double>& joint = mechanism.joints()[j];
    const int n = joint.num_constraints();
    if (n == 0) continue;
    for (const bool is_Q : {false, true}) {
      const int body = is_Q ? joint.to : joint.from;
      if (body == kGround) continue;
      sides_of_body[body].push_back(static_cast<int>(sides.size()));
      sides.push_back({j, static_cast<int>(rows.size()), body, n, is_Q, first, row});
      first += n;
    }
    joints.push_back(j);
    rows.push_back(n);
    row += n;
  }
  double numbers = 0.0;
  for (const std::vector<int>& on_body : sides_of_body) {
    double count = 0.0;
    for (int side : on_body) count += sides[side].rows;
    numbers += count * count;
  }
  if (numbers > most) return nullptr;
  std::vector<std::pair<int, int>> pairs;
  for (const std::vector<int>& on_body : sides_of_body) {
    for (std::size_t a = 0; a < on_body.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        pairs.emplace_back(sides[on_body[a]].block, sides[on_body[b]].block);
      }
    }
  }
  BlockCholesky X(std::move(rows), pairs, most);
  if (X.numbers() > most) return nullptr;
  return std::unique_ptr<JointResponse>(new JointResponse(
      std::move(sides), std::move(joints), std::move(X), mechanism.joints(), sides_of_body));
}

template <class Space>
JointResponse<Space>::JointResponse(std::vector<Side> sides, std::vector<int> joints,
                                    BlockCholesky X, std::span<const Joint<Space, double>> all,
                                    const std::vector<std::vector<int>>& sides_of_body)
    : sides_(std::move(sides)),
      joints_(std::move(joints)),
      X_(std::move(X)),
      x_(static_cast<std::size_t>(X_.size()), 0.0),
      phi_(all.size(), Components<Space, double>::Zero()) {
  int rows = 0;
  for (const Side& side : sides_) rows += side.rows;
  c_.assign(rows, Wrench<Space, double>::Zero());
  Mc_.assign(rows, Acceleration<Space, double>::Zero());
  for (int block = 0; block < static_cast<int>(joints_.size()); ++block) {
    inverse_shares_.push_back(1.0 / ShareOfLimit(X_.eliminated(block)));
    on_loops_.push_back(all[static_cast<std::size_t>(joints_[block])].on_loop);
  }
  for (const std::vector<int>& on_body : sides_of_body) {
    for (std::size_t a = 0; a < on_body.size(); ++a) {
      for (std::size_t b = 0; b <= a; ++b) {
        int first = on_body[a], second = on_body[b];
        const int i = sides_[first].block, j = sides_[second].block;
        if (i != j && X_.FirstOf(i, j) == j) std::swap(first, second);
        pairs_.push_back({first, second, i == j ? X_.Diagonal(i) : X_.OffDiagonal(i, j)});
      }
    }
  }
}

template <class Space>
bool JointResponse<Space>::Factor(const Kinematics<Space, double>& kinematics, Masses masses) {
  const std::vector<Inertia<Space, double>>& inertias = kinematics.mechanism().bodies(masses);
  for (const Side& side : sides_) {
    const JointState<Space, double>& state = kinematics.joints()[side.joint];
    const Inertia<Space, double>& inertia = inertias[side.body];
    const Linear<Space, double> r =
        side.is_Q ? kinematics.ArmQ(side.joint, masses) : kinematics.ArmP(side.joint, masses);
    const auto inverse = kinematics.RotationalInverse(inertia, side.body);
    const double per_mass = 1.0 / inertia.mass;
    for (int i = 0; i < side.rows; ++i) {
      const Wrench<Space, double> at_com = ShiftForce<Space, double>(state.D(i), r);
      const Wrench<Space, double> c = side.is_Q ? at_com : -at_com;
      c_[side.first + i] = c;
      Mc_[side.first + i] = {inverse * c.angular, c.linear * per_mass};
    }
  }
  X_.SetZero();
  for (const Pair& pair : pairs_) {
    const Side &first = sides_[pair.first], &second = sides_[pair.second];
    const Wrench<Space, double>* c = &c_[first.first];
    const Acceleration<Space, double>* Mc = &Mc_[second.first];
    WithSize<double, 2, 3, 5>(second.rows, [&](auto columns) {
      for (int i = 0; i < first.rows; ++i) {
        const int last = pair.first == pair.second ? i + 1 : int{columns};
        for (int k = 0; k < last; ++k) pair.block[i * columns + k] += c[i].dot(Mc[k]);
      }
    });
  }
  const bool is_positive = X_.Factor();
  rcond_ = 1.0;
  worst_joint_ = -1;
  double worst = 1.0, worst_on_loops = 1.0;
  for (int block = 0; block < static_cast<int>(joints_.size()); ++block) {
    const double ratio = X_.ratio(block), of_limit = ratio * inverse_shares_[block];
    rcond_ = std::min(rcond_, ratio);
    // NaN also passes
    if (on_loops_[static_cast<std::size_t>(block)] && !(of_limit >= worst_on_loops)) {
      worst_on_loops = of_limit;
    }
    if (of_limit >= worst) continue;
    worst = of_limit;
    worst_joint_ = joints_[block];
  }
  has_rank_ = is_positive && worst_on_loops >= LoopSolver<double>::kSuspicious;
  return is_positive && worst >= LoopSolver<double>::kSuspicious;
}

template <class Space>
bool JointResponse<Space>::IsFinite() const {
  double zeros = 0.0;  // or not a number
  for (std::size_t i = 0; i < c_.size(); ++i) zeros += 0.0 * c_[i].dot(Mc_[i]);
  return zeros == 0.0;
}

template <class Space>
void JointResponse<Space>::Solve(std::span<const Acceleration<Space, double>> b,
                                 std::span<const Components<Space, double>> c0,
                                 std::span<Acceleration<Space, double>> A) {
  for (std::size_t k = 0, row = 0; k < joints_.size(); ++k) {
    for (int i = 0; i < X_.rows(static_cast<int>(k)); ++i) x_[row++] = -c0[joints_[k]][i];
  }
  if (b.empty()) {
    std::ranges::fill(A, Acceleration<Space, double>::Zero());
  } else {
    for (const Side& side : sides_) {
      for (int i = 0; i < side.rows; ++i) x_[side.row + i] -= c_[side.first + i].dot(b[side.body]);
    }
    std::ranges::copy(b, A.begin());
  }
  X_.Solve(x_.data());
  for (const Side& side : sides_) {
    for (int i = 0; i < side.rows; ++i) {
      A[side.body] += Mc_[side.first + i] * x_[side.row + i];
      phi_[side.joint][i] = x_[side.row + i];
    }
  }
}

template <class Space>
bool AreIndependent(const Kinematics<Space, double>& kinematics) {
  const auto response = JointResponse<Space>::Make(kinematics.mechanism(), kMaxOfResponse);
  return response != nullptr && response->Factor(kinematics, Masses::kGeometric);
}

template class JointResponse<Planar>;
template class JointResponse<Spatial>;
template bool AreIndependent(const Kinematics<Planar, double>&);
template bool AreIndependent(const Kinematics<Spatial, double>&);

}  // namespace loopbench
