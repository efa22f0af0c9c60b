#include "mechanism/structure.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "mechanism/scaled_loops.h"

namespace loopbench {

namespace {

/// Rows that a pivoted factorisation leaves over once it has found the rank.
template <class Space>
std::vector<RedundantDirection> FindRedundant(const MechanismDescription& description,
                                              const Mechanism<Space, double>& mechanism,
                                              const ScaledLoops& scaled) {
  std::vector<RedundantDirection> redundant;
  if (scaled.rows.rows() == scaled.rank) return redundant;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(scaled.rows.transpose());
  const auto& order = qr.colsPermutation().indices();
  std::vector<int> left(order.data() + scaled.rank, order.data() + order.size());
  std::ranges::sort(left);
  for (const int row : left) {
    for (int index : mechanism.constraints()) {
      const Joint<Space, double>& joint = mechanism.joints()[index];
      const int i = row - joint.row;
      if (i < 0 || i >= joint.num_constraints()) continue;
      // drives stand first in D, in the order of their coordinates
      const bool drive = i < joint.num_drives;
      const int at = drive ? mechanism.drives()[joint.first_drive + i].coordinate
                           : joint.kind->num_u + i - joint.num_drives;
      const int component = joint.kind->axes[at];
      RedundantDirection direction;
      direction.joint = joint.description;
      direction.drive = drive;
      direction.moment = component < Space::kRot;
      direction.axis = direction.moment ? (Space::kRot == 1 ? 'z' : "xyz"[component])
                                        : "xyz"[component - Space::kRot];
      direction.ground_axes = joint.kind->isotropic;
      const JointType type = description.joints[joint.description].type;
      if (type == JointType::kRod) direction.axis = 'r', direction.moment = false;
      if (type == JointType::kUniversal && direction.moment && !drive) direction.axis = 'n';
      redundant.push_back(direction);
    }
  }
  return redundant;
}

template <class Space>
class Analysis {
 public:
  explicit Analysis(const MechanismDescription& description)
      : description_(description), mechanism_(description, Coordinates::kJoint) {}

  Structure Run() {
    Count();
    result_.islands = FindIslands(description_);
    result_.start = Assemble<Space>(description_, mechanism_);
    Kinematics<Space, double> kinematics(mechanism_);
    kinematics.UpdatePosition(result_.start.q);
    for (int index : mechanism_.constraints()) result_.loops.push_back(FindLoop(index, kinematics));
    result_.analysed = result_.joint_u <= kMostAnalysedSpeeds;
    if (!result_.analysed) return result_;
    const ScaledLoops here = ScaleLoops(kinematics);
    result_.rank = here.rank;
    result_.singular_values = here.singular_values;
    const ScaledLoops nearby = Nearby(here, kinematics);
    result_.rank_nearby = nearby.rank;
    result_.redundant = FindRedundant(description_, mechanism_, nearby);
    return result_;
  }

 private:
  void Count() {
    const Mechanism<Space, double> absolute(description_, Coordinates::kAbsolute);
    result_.space = description_.space;
    result_.bodies = mechanism_.num_bodies() - 1;
    result_.joints = static_cast<int>(description_.joints.size());
    result_.rows = absolute.num_rows();
    result_.loop_rows = mechanism_.num_rows();
    result_.joint_q = mechanism_.num_q();
    result_.joint_u = mechanism_.num_u();
    result_.absolute_q = absolute.num_q();
    result_.absolute_u = absolute.num_u();
    result_.counted_freedom = Space::kDim * result_.bodies - result_.rows;
  }

  /// From a body up to Ground: the steps of the tree.
  std::vector<TreeStep> PathToGround(int body) const {
    std::vector<TreeStep> path;
    while (body != kGround) {
      path.push_back(mechanism_.tree()[mechanism_.step_of_body(body)]);
      body = path.back().parent;
    }
    return path;
  }

  LoopPath FindLoop(int index, const Kinematics<Space, double>& kinematics) const {
    const Joint<Space, double>& joint = mechanism_.joints()[index];
    std::vector<TreeStep> up = PathToGround(joint.to), down = PathToGround(joint.from);
    while (!up.empty() && !down.empty() && up.back().joint == down.back().joint) {
      up.pop_back();
      down.pop_back();
    }
    LoopPath loop;
    loop.cut_joint = index;
    loop.joints.push_back(index);
    loop.bodies.push_back(joint.to);
    for (const TreeStep& step : up) {
      loop.joints.push_back(step.joint);
      loop.bodies.push_back(step.parent);
    }
    for (auto step = down.rbegin(); step != down.rend(); ++step) {
      loop.joints.push_back(step->joint);
      loop.bodies.push_back(step->child);
    }
    const auto D = kinematics.joints()[index].D();
    const Motion<Space, double> all = kinematics.ConstraintMismatch(index);
    const Motion<Space, double> open = D * (D.transpose() * all);
    loop.open_rotation = open.template head<Space::kRot>().norm();
    loop.open_shift = open.template tail<Space::kLin>().norm();
    return loop;
  }

  /// The loops a little way along a motion they permit; `here` where nothing moves.
  ScaledLoops Nearby(const ScaledLoops& here, const Kinematics<Space, double>& kinematics) const {
    const bool assembled = result_.start.outcome != Outcome::kInconsistentStart;
    if (here.to_u.cols() == 0 || here.rank == here.rows.rows() || !assembled) return here;
    // along a given motion the start cannot be moved without its time
    if (!mechanism_.drives().empty()) return here;
    // no special direction: an irrational mixture of all of them
    Eigen::VectorXd mixture(here.to_u.cols());
    for (Eigen::Index i = 0; i < mixture.size(); ++i)
      mixture[i] = std::cos(1.0 + static_cast<double>(i * i));
    Eigen::VectorXd u = here.to_u * mixture;
    u *= kNearby / u.lpNorm<Eigen::Infinity>();
    VectorX<double> q_rate(mechanism_.num_q());
    mechanism_.Rates(result_.start.q, u, q_rate);
    const VectorX<double> q = result_.start.q + q_rate;

    MechanismDescription moved = description_;
    moved.initial = {};
    for (JointDescription& joint : moved.joints) joint.cut = false;
    for (int index : mechanism_.constraints()) moved.joints[index].cut = true;  // the same forest
    for (const TreeStep& step : mechanism_.tree()) {
      const Joint<Space, double>& joint = mechanism_.joints()[step.joint];
      if (joint.description < 0 || joint.kind->num_q == 0) continue;
      const double* first = q.data() + joint.q_offset;
      moved.initial.coordinates.push_back(
          {joint.description, std::vector<double>(first, first + joint.kind->num_q)});
    }
    const Mechanism<Space, double> mechanism(moved, Coordinates::kJoint);
    const Start<double> start = Assemble<Space>(moved, mechanism);
    if (start.outcome != Outcome::kFinished || mechanism.num_q() != kinematics.mechanism().num_q())
      return here;
    Kinematics<Space, double> there(mechanism);
    there.UpdatePosition(start.q);
    ScaledLoops nearby = ScaleLoops(there);
    // fewer than here would be an accident of the second position
    return nearby.rank >= here.rank ? nearby : here;
  }

  const MechanismDescription& description_;
  Mechanism<Space, double> mechanism_;
  Structure result_;
};

}  // namespace

double Structure::conditioning() const {
  return rank > 0 ? singular_values[rank - 1] / singular_values[0] : 1.0;
}

Structure AnalyseStructure(const MechanismDescription& description) {
  return description.space == SpaceKind::kPlanar ? Analysis<Planar>(description).Run()
                                                 : Analysis<Spatial>(description).Run();
}

}  // namespace loopbench
