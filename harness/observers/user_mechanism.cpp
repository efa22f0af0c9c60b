#include <Eigen/Sparse>
#include <Eigen/SparseQR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/observers/trajectory.h"
#include "mechanism/algebra/factors.h"
#include "mechanism/loops/tree_dynamics.h"

namespace loopbench::harness {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <class Space, class Kind>
Eigen::Vector3d LinearOf(const SpatialVector<Space, double, Kind>& V) {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  for (int i = 0; i < Space::kLin; ++i) v[i] = V.linear[i];
  return v;
}
template <class Space, class Kind>
Eigen::Vector3d AngularOf(const SpatialVector<Space, double, Kind>& V) {
  Eigen::Vector3d w = Eigen::Vector3d::Zero();
  for (int i = 0; i < Space::kRot; ++i) w[Space::kRot == 1 ? 2 : i] = V.angular[i];
  return w;
}

/// Returns the motion of the centre of mass, in the part's ground axes.
template <class Space>
BodyMotion AtCentre(const Pose<Space, double>& pose, const Velocity<Space, double>& V) {
  BodyMotion motion;
  for (int i = 0; i < Space::kLin; ++i) {
    motion.pose.p[i] = pose.p[i];
    for (int j = 0; j < Space::kLin; ++j) motion.pose.R(i, j) = pose.R(i, j);
  }
  if constexpr (Space::kRot == 1) motion.angle = pose.angle;
  motion.velocity = LinearOf(V);
  motion.angular_velocity = AngularOf(V);
  motion.acceleration = motion.angular_acceleration = Eigen::Vector3d::Constant(kNaN);
  return motion;
}

}  // namespace

std::vector<BodyMotion> AtRest(const Compiled& compiled) {
  std::vector<BodyMotion> bodies(compiled.bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (compiled.bodies[i].part >= 0) continue;
    bodies[i].pose = compiled.bodies[i].X;
    bodies[i].angle = compiled.bodies[i].turn;
  }
  return bodies;
}

template <class Space>
void EnterPart(const Compiled& compiled, int part, const Kinematics<Space, double>& kinematics,
               std::span<const Acceleration<Space, double>> accelerations,
               std::vector<BodyMotion>* bodies) {
  const CompiledPart& own = compiled.parts[static_cast<std::size_t>(part)];
  for (std::size_t i = 0; i < compiled.bodies.size(); ++i) {
    const BodyImage& image = compiled.bodies[i];
    if (image.part != part) continue;
    const auto b = static_cast<std::size_t>(image.body);
    BodyMotion carrier = AtCentre<Space>(kinematics.poses()[b], kinematics.motions()[b]);
    if (!accelerations.empty()) {
      carrier.acceleration = LinearOf(accelerations[b]);
      carrier.angular_acceleration = AngularOf(accelerations[b]);
    }
    Eigen::Vector3d com = own.description.bodies[b].com;
    if (Space::kRot == 1) com.z() = 0.0;
    // the user's origin relative to the carrier's centre of mass, in carrier axes
    const Eigen::Vector3d at = image.X.p - com;
    BodyMotion& body = (*bodies)[i];
    body.pose = {own.R_WC * carrier.pose.R * image.X.R, own.R_WC * carrier.PointAt(at)};
    body.angle = carrier.angle + image.turn;
    body.velocity = own.R_WC * carrier.VelocityAt(at);
    body.angular_velocity = own.R_WC * carrier.angular_velocity;
    body.acceleration = own.R_WC * carrier.AccelerationAt(at);
    body.angular_acceleration = own.R_WC * carrier.angular_acceleration;
  }
}

#define LOOPBENCH_INSTANTIATE(Space)                                              \
  template void EnterPart(const Compiled&, int, const Kinematics<Space, double>&, \
                          std::span<const Acceleration<Space, double>>, std::vector<BodyMotion>*);
LOOPBENCH_INSTANTIATE(Planar)
LOOPBENCH_INSTANTIATE(Spatial)
#undef LOOPBENCH_INSTANTIATE

template <class Space>
UserMechanism<Space>::UserMechanism(const MechanismDescription& user)
    : mechanism_(Unreleased(user), Coordinates::kAbsolute),
      kinematics_(mechanism_),
      q_(VectorX<double>::Zero(mechanism_.num_q())),
      u_(VectorX<double>::Zero(mechanism_.num_u())) {
  for (const BodyDescription& body : user.bodies) com_.push_back(body.com);
}

template <class Space>
void UserMechanism<Space>::Set(double t, std::span<const BodyMotion> bodies,
                               std::span<const double> followed) {
  for (const TreeStep& step : mechanism_.tree()) {
    // virtual free joint from Ground to the centre of mass
    const Joint<Space, double>& joint = mechanism_.joints()[step.joint];
    const auto b = static_cast<std::size_t>(step.child);
    const BodyMotion& body = bodies[b];
    const Eigen::Vector3d p = body.PointAt(com_[b]), v = body.VelocityAt(com_[b]);
    double* q = q_.data() + joint.q_offset;
    double* u = u_.data() + joint.u_offset;
    if constexpr (Space::kRot == 1) {
      q[0] = body.angle;
      u[0] = body.angular_velocity.z();
    } else {
      Pose<Space, double> X;
      X.R = Rotation<Space, double>(body.pose.R);
      ToQuaternion(X.R, q);
      for (int i = 0; i < 3; ++i) u[i] = body.angular_velocity[i];
    }
    for (int i = 0; i < Space::kLin; ++i) {
      q[joint.kind->num_q - Space::kLin + i] = p[i];
      u[Space::kRot + i] = v[i];
    }
  }
  kinematics_.SetTime(t);
  for (std::size_t j = 0; j < followed.size(); ++j) {
    if (std::isfinite(followed[j])) kinematics_.ContinueFrom(static_cast<int>(j), followed[j]);
  }
  kinematics_.UpdatePosition(q_);
  kinematics_.UpdateVelocity(u_);
  kinematics_.AcceptStep();
}

template <class Space>
const Direction<Space, double>& UserMechanism<Space>::DirectionOfSpeed(int index, int i) const {
  const Joint<Space, double>& joint = mechanism_.joints()[index];
  const JointState<Space, double>& state = kinematics_.joints()[index];
  const int drive = mechanism_.DriveOf(joint, i);
  if (drive >= 0) return state.D(drive - joint.first_drive);
  int free = i;
  for (int k = 0; k < i; ++k) free -= mechanism_.DriveOf(joint, k) >= 0;
  return state.H(free);
}

template <class Space>
void UserMechanism<Space>::Measure(int index, double* q, double* u) const {
  const Joint<Space, double>& joint = mechanism_.joints()[index];
  const auto& poses = kinematics_.poses();
  const Pose<Space, double> X_FM = Compose(Inverse(Compose(poses[joint.from], joint.X_PF)),
                                           Compose(poses[joint.to], joint.X_QM));
  joint.kind->coordinates(X_FM, q, joint.kind->parameter);
  if (joint.kind->num_u == 1) q[0] = kinematics_.JointCoordinate(index);
  const Velocity<Space, double>& V = kinematics_.joints()[index].V_rel;
  for (int i = 0; i < joint.kind->num_u; ++i) {
    u[i] = joint.kind->inverse_H_squared * DirectionOfSpeed(index, i).dot(V);
  }
}

template <class Space>
JointMismatch UserMechanism<Space>::MismatchOf(int index) const {
  const JointState<Space, double>& state = kinematics_.joints()[index];
  const Components<Space, double> positions =
      state.Along(kinematics_.ConstraintMismatch(index), state.rows());
  const Components<Space, double> speeds = kinematics_.ConstraintSpeed(index);
  Direction<Space, double> shift = state.Sum(positions, state.rows());
  Direction<Space, double> rate = state.Sum(speeds, state.rows());
  return {.shift = shift.linear.norm(),
          .rotation = shift.angular.norm(),
          .velocity = rate.linear.norm(),
          .angular_velocity = rate.angular.norm()};
}

template <class Space>
double UserMechanism<Space>::RelativeMismatch() const {
  double largest = 0.0;
  for (const int joint : mechanism_.constraints()) {
    const JointMismatch mismatch = MismatchOf(joint);
    largest = std::max({largest, mismatch.rotation, mismatch.shift / mechanism_.length()});
  }
  return largest;
}

template class UserMechanism<Planar>;
template class UserMechanism<Spatial>;
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
/// Number of unknowns up to which dense QR is faster, and up to which its cost is acceptable.
constexpr Eigen::Index kFew = 60, kMost = 900;
/// Singular directions are free if below this multiple of a relative violation e of the positions.
constexpr double kOfMismatch = 10.0;

/// Solutions of G x = w: a particular one, and columns that span the homogeneous ones.
struct Solution {
  Eigen::VectorXd x;
  Eigen::MatrixXd open;  ///< empty if x is unique
  bool is_known = true;  ///< false: no component is known
};

/// Solves by Q R P^T = G with column pivoting; pivots below `limit` of the first are free.
Solution SolveDense(const Eigen::MatrixXd& G, const Eigen::VectorXd& w, double limit) {
  Eigen::ColPivHouseholderQR<MatrixX<double>> qr(G);
  const auto& R = qr.matrixR();
  const Eigen::Index n = G.cols();
  Eigen::Index rank = 0;
  while (rank < std::min(G.rows(), n) && std::abs(R(rank, rank)) > limit * std::abs(R(0, 0))) {
    ++rank;
  }
  const MatrixX<double> R11 = R.topLeftCorner(rank, rank);
  VectorX<double> y = w;
  y.applyOnTheLeft(qr.householderQ().setLength(qr.nonzeroPivots()).adjoint());
  Solution solution;
  VectorX<double> x = VectorX<double>::Zero(n);
  x.head(rank) = R11.triangularView<Eigen::Upper>().solve(y.head(rank));
  solution.x = qr.colsPermutation() * x;
  if (rank == n) return solution;
  MatrixX<double> open = MatrixX<double>::Identity(n, n).rightCols(n - rank);
  open.topRows(rank) =
      -R11.triangularView<Eigen::Upper>().solve(MatrixX<double>(R.topRightCorner(rank, n - rank)));
  solution.open = qr.colsPermutation() * open;
  return solution;
}

}  // namespace

template <class Space>
struct Reactions<Space>::Work {
  using Coefficients = Eigen::Triplet<double>;

  explicit Work(const UserMechanism<Space>& of)
      : user(of),
        w(of.mechanism().num_bodies()),
        total(of.mechanism().joints().size()),
        open(total.size()),
        left(w.size()),
        first(total.size()),
        joints_of(w.size()) {
    const auto& joints = user.mechanism().joints();
    for (int j = 0; j < static_cast<int>(joints.size()); ++j) {
      if (joints[j].in_tree() || joints[j].num_directions() == 0) continue;
      bearing.push_back(j);
      for (const int body : {joints[j].from, joints[j].to}) {
        if (body != kGround) joints_of[body].push_back(j);
      }
    }
  }

  const JointState<Space, double>& State(int j) const { return user.kinematics().joints()[j]; }
  const Joint<Space, double>& At(int j) const { return user.mechanism().joints()[j]; }

  /// Subtracts the joint's wrench from the wrenches that its bodies still need.
  void Give(int j) {
    w[At(j).to] -= ShiftForce<Space, double>(total[j], State(j).r_Q);
    w[At(j).from] += ShiftForce<Space, double>(total[j], State(j).r_P);
    for (const int body : {At(j).from, At(j).to}) --left[body];
    is_done[j] = true;
  }

  /// Solves bodies with one joint left, repeatedly.
  void Leaves() {
    std::vector<int> queue;
    for (int b = 1; b < static_cast<int>(left.size()); ++b) {
      if (left[b] == 1) queue.push_back(b);
    }
    while (!queue.empty()) {
      const int body = queue.back();
      queue.pop_back();
      if (left[body] != 1) continue;
      const int j = *std::ranges::find_if(joints_of[body], [&](int k) { return !is_done[k]; });
      const bool is_second = At(j).to == body;
      const Wrench<Space, double> needed = ShiftForce<Space, double>(
          is_second ? w[body] : -w[body], is_second ? -State(j).r_Q : -State(j).r_P);
      total[j].setZero();
      for (int i = 0; i < State(j).directions(); ++i) {
        const auto& D = State(j).D(i);
        total[j] += D * (D.dot(needed) / D.squaredNorm());
      }
      Give(j);
      const int other = is_second ? At(j).from : At(j).to;
      if (other != kGround && left[other] == 1) queue.push_back(other);
    }
  }

  /// Returns the unsolved joints connected to `start` without passing Ground.
  std::vector<int> PartOf(int start) {
    std::vector<int> part = {start};
    is_done[start] = true;
    for (std::size_t i = 0; i < part.size(); ++i) {
      for (const int body : {At(part[i]).from, At(part[i]).to}) {
        if (body == kGround) continue;
        for (const int j : joints_of[body]) {
          if (is_done[j]) continue;
          is_done[j] = true;
          part.push_back(j);
        }
      }
    }
    return part;
  }

  /// Returns the norm of a direction in (*), with moments over the mechanism's length.
  double SizeOf(const Direction<Space, double>& D) const {
    return std::sqrt(D.angular.squaredNorm() / (length() * length()) + D.linear.squaredNorm());
  }
  double length() const { return user.mechanism().length(); }
  double SizeOfForce(const Coupling<double>& coupling) const {
    double most = 0.0;
    for (const auto& [j, ratio] : coupling.parts) {
      const double size = SizeOf(user.DirectionOfSpeed(j, 0));
      most = std::max(most, std::abs(ratio) * At(j).kind->inverse_H_squared * size);
    }
    return most;
  }

  void SolvePart(const std::vector<int>& part, double limit) {
    std::vector<int> place(w.size(), -1);
    Eigen::Index rows = 0, columns = 0;
    std::vector<Coefficients> entries;
    const auto enter = [&](int body, const auto& at_centre, double sign) {
      if (body == kGround) return;
      if (place[body] < 0) {
        place[body] = static_cast<int>(rows);
        rows += Space::kDim;
      }
      for (int i = 0; i < Space::kDim; ++i) {
        const double unit = i < Space::kRot ? 1 / length() : 1.0;
        entries.emplace_back(place[body] + i, columns, sign * unit * at_centre[i]);
      }
    };
    for (const int j : part) {
      first[j] = columns;
      for (int i = 0; i < State(j).directions(); ++i, ++columns) {
        const Direction<Space, double>& D = State(j).D(i);
        const double scale = 1 / SizeOf(D);
        enter(At(j).to, ShiftForce<Space, double>(D, State(j).r_Q), scale);
        enter(At(j).from, ShiftForce<Space, double>(D, State(j).r_P), -scale);
      }
    }
    const Eigen::Index first_coupling = columns;
    for (const Coupling<double>& coupling : user.mechanism().couplings()) {
      const double most = SizeOfForce(coupling);
      for (const auto& [j, ratio] : coupling.parts) {
        const Wrench<Space, double> F = WrenchOfEffort<Space, double>(
            user.DirectionOfSpeed(j, 0), At(j).kind->inverse_H_squared, 1.0);
        const double scale = ratio / most;
        enter(At(j).to, ShiftForce<Space, double>(F, State(j).r_Q), scale);
        enter(At(j).from, ShiftForce<Space, double>(F, State(j).r_P), -scale);
      }
      ++columns;
    }
    Eigen::VectorXd needed(rows);
    for (std::size_t b = 1; b < place.size(); ++b) {
      for (int i = 0; place[b] >= 0 && i < Space::kDim; ++i) {
        needed[place[b] + i] = w[b][i] / (i < Space::kRot ? length() : 1.0);
      }
    }
    const Solution solution = Solved(entries, needed, columns, limit);
    Enter(part, solution);
    mu.clear();
    for (const Coupling<double>& coupling : user.mechanism().couplings()) {
      const Eigen::Index column = first_coupling + std::ssize(mu);
      const auto changes = [&](double change) { return std::abs(change) > negligible; };
      const bool is_known =
          solution.is_known &&
          (solution.open.cols() == 0 || std::ranges::none_of(solution.open.row(column), changes));
      mu.push_back(is_known ? solution.x[column] / SizeOfForce(coupling) : kNaN);
    }
  }

  static Solution Solved(const std::vector<Coefficients>& entries, const Eigen::VectorXd& needed,
                         Eigen::Index columns, double limit) {
    Eigen::SparseMatrix<double> G(needed.size(), columns);
    G.setFromTriplets(entries.begin(), entries.end());
    if (columns > kFew) {
      G.makeCompressed();
      Eigen::SparseQR<Eigen::SparseMatrix<double>, Eigen::COLAMDOrdering<int>> qr;
      qr.setPivotThreshold(limit);  // columns have a norm near one
      qr.compute(G);
      if (qr.info() == Eigen::Success && qr.rank() == columns) return {qr.solve(needed), {}, true};
    }
    if (columns > kMost) return {{}, {}, false};
    return SolveDense(G.toDense(), needed, limit);
  }

  void Enter(const std::vector<int>& part, const Solution& solution) {
    for (const int j : part) {
      total[j].setZero();
      const int count = State(j).directions();
      open[j].assign(static_cast<std::size_t>(solution.open.cols()), Wrench<Space, double>::Zero());
      for (int i = 0; !solution.is_known && i < Space::kDim; ++i) total[j][i] = kNaN;
      for (int i = 0; solution.is_known && i < count; ++i) {
        const Wrench<Space, double> D = State(j).D(i) * (1 / SizeOf(State(j).D(i)));
        total[j] += D * solution.x[first[j] + i];
        for (std::size_t k = 0; k < open[j].size(); ++k) {
          open[j][k] += D * solution.open(first[j] + i, static_cast<Eigen::Index>(k));
        }
      }
    }
  }

  /// Returns true if no homogeneous solution changes the power of the joint's wrench for a motion.
  bool IsKnown(int j, const Velocity<Space, double>& along) const {
    const double size = along.angular.norm() * length() + along.linear.norm();
    return std::ranges::all_of(open[j], [&](const Wrench<Space, double>& change) {
      return std::abs(change.dot(along)) <= negligible * size;
    });
  }

  const UserMechanism<Space>& user;
  std::vector<Wrench<Space, double>> w;      ///< wrenches that bodies still need
  std::vector<Wrench<Space, double>> total;  ///< wrenches on second bodies, including drives
  std::vector<std::vector<Wrench<Space, double>>> open;  ///< homogeneous solutions
  std::vector<double> mu;           ///< by coupling: its efforts over their coefficients
  std::vector<int> left;            ///< number of unsolved joints of a body
  std::vector<Eigen::Index> first;  ///< column of a joint's first direction
  std::vector<std::vector<int>> joints_of;
  std::vector<int> bearing;  ///< the user's joints with constrained directions
  std::vector<bool> is_done;
  double negligible = 0.0;
};

template <class Space>
Reactions<Space>::Reactions(const UserMechanism<Space>& user)
    : work_(std::make_unique<Work>(user)) {}
template <class Space>
Reactions<Space>::~Reactions() = default;

template <class Space>
void Reactions<Space>::Solve(std::span<const Acceleration<Space, double>> A,
                             std::span<const Wrench<Space, double>> applied) {
  Work& work = *work_;
  work.w[kGround].setZero();
  for (int b = 1; b < static_cast<int>(work.w.size()); ++b) {
    work.w[b] = InertialForce<Space, double>(work.user.kinematics(), b, A[b]) - applied[b];
    work.left[b] = static_cast<int>(work.joints_of[b].size());
  }
  AddRotorWrenches<Space, double>(work.user.kinematics(), A, work.w);
  for (auto& open : work.open) open.clear();
  work.is_done.assign(work.total.size(), false);
  const bool is_coupled = !work.user.mechanism().couplings().empty();
  if (!is_coupled) work.Leaves();
  const double limit = std::max(100 * kEpsilon * static_cast<double>(work.bearing.size()),
                                kOfMismatch * work.user.RelativeMismatch());
  // geometric mean of round-off (a multiple of the limit) and a share of the load
  work.negligible = std::sqrt(limit);
  if (is_coupled) return work.SolvePart(work.bearing, limit);
  for (const int j : work.bearing) {
    if (!work.is_done[j]) work.SolvePart(work.PartOf(j), limit);
  }
}

template <class Space>
Wrench<Space, double> Reactions<Space>::Of(int joint, const Rotation<Space, double>& axes) const {
  const JointState<Space, double>& state = work_->State(joint);
  const auto& given = work_->At(joint);
  Wrench<Space, double> reaction = work_->total[joint];
  std::vector<Wrench<Space, double>> open = work_->open[joint];
  for (int i = 0; i < given.num_drives; ++i) {
    const Direction<Space, double>& D = state.D(i);
    const auto without = [&](Wrench<Space, double>& wrench) {
      const double effort = wrench.dot(Velocity<Space, double>(D * 1.0));
      wrench -= WrenchOfEffort<Space, double>(D, 1 / D.squaredNorm(), effort);
    };
    without(reaction);
    std::ranges::for_each(open, without);
  }
  const Rotation<Space, double> to_axes = axes.transpose();
  reaction = Rotate<Space, double>(to_axes, reaction);
  for (const Wrench<Space, double>& change : open) {
    const Wrench<Space, double> turned = Rotate<Space, double>(to_axes, change);
    for (int i = 0; i < Space::kDim; ++i) {
      const double unit = i < Space::kRot ? work_->length() : 1.0;
      if (std::abs(turned[i]) > work_->negligible * unit) reaction[i] = kNaN;
    }
  }
  return reaction;
}

template <class Space>
double Reactions<Space>::DriveOf(int joint, int coordinate) const {
  const Velocity<Space, double> along = work_->user.DirectionOfSpeed(joint, coordinate) * 1.0;
  return work_->IsKnown(joint, along) ? work_->total[joint].dot(along) : kNaN;
}

template <class Space>
double Reactions<Space>::CouplingOf(int coupling, int part) const {
  const auto& parts = work_->user.mechanism().couplings()[coupling].parts;
  return parts[part].ratio * work_->mu[coupling];
}

template class Reactions<Planar>;
template class Reactions<Spatial>;

}  // namespace loopbench::harness
