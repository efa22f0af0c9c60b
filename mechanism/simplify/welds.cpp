#include "mechanism/simplify/welds.h"

#include "mechanism/description/topology.h"

namespace loopbench {

namespace {

/// Poses along two ways through the same welds agree to this, in rad and in units of the arms.
constexpr double kAgrees = 1e-12;

Attachment Then(const Attachment& first, const Frame& X, double turn) {
  Attachment at = first;
  at.X = first.X * X;
  at.turn = first.turn + turn;
  return at;
}

/// The group of welded bodies that begins with `root`; its poses seen from there.
class Group {
 public:
  Group(const MechanismDescription& description, const std::vector<bool>& welds,
        const std::vector<bool>& in_tree, int root)
      : description_(description),
        welds_(welds),
        in_tree_(in_tree),
        at_(description.bodies.size()) {
    at_[root].attached = true;
    at_[root].carrier = root;
    bodies_.push_back(root);
    for (std::size_t k = 0; k < bodies_.size(); ++k) GrowFrom(bodies_[k]);
  }

  const std::vector<int>& bodies() const { return bodies_; }
  const Attachment& at(int body) const { return at_[body]; }

  /// Returns true if all joints within the group are welds that agree.
  bool IsOneBody() const {
    for (std::size_t j = 0; j < description_.joints.size(); ++j) {
      const JointDescription& joint = description_.joints[j];
      const Attachment& P = at_[joint.from.body];
      const Attachment& Q = at_[joint.to.body];
      if (!P.attached || !Q.attached) continue;
      if (!welds_[j]) return false;
      const auto X_F = P.X * PoseOf(joint.from), X_M = Q.X * PoseOf(joint.to);
      const double arm = 1.0 + X_F.p.norm() + joint.to.position.norm();
      if ((X_F.R - X_M.R).norm() > kAgrees || (X_F.p - X_M.p).norm() > kAgrees * arm) return false;
    }
    return true;
  }

 private:
  void GrowFrom(int body) {
    for (std::size_t j = 0; j < description_.joints.size(); ++j) {
      const JointDescription& joint = description_.joints[j];
      if (!welds_[j] || !in_tree_[j]) continue;
      for (const auto& [here, there] :
           {std::pair{&joint.from, &joint.to}, {&joint.to, &joint.from}}) {
        if (here->body != body || at_[there->body].attached) continue;
        at_[there->body] = Then(at_[body], PoseOf(*here) * PoseOf(*there).Inverse(),
                                here->rotation.z() - there->rotation.z());
        bodies_.push_back(there->body);
      }
    }
  }

  const MechanismDescription& description_;
  const std::vector<bool>& welds_;
  const std::vector<bool>& in_tree_;
  std::vector<Attachment> at_;
  std::vector<int> bodies_;
};

}  // namespace

std::vector<Attachment> FindWelded(const MechanismDescription& description) {
  std::vector<bool> welds;
  for (const JointDescription& joint : description.joints) {
    welds.push_back(joint.type == JointType::kWeld);
  }
  return FindWelded(description, welds);
}

std::vector<Attachment> FindWelded(const MechanismDescription& description,
                                   const std::vector<bool>& welds) {
  std::vector<Attachment> attachments(description.bodies.size());
  std::vector<bool> seen(description.bodies.size(), false), welded(seen);
  std::vector<bool> in_tree(description.joints.size(), true);
  for (const int j : BuildTopology(description, Coordinates::kJoint).constraints)
    in_tree[j] = false;
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    const JointDescription& joint = description.joints[j];
    if (welds[j]) welded[joint.from.body] = welded[joint.to.body] = true;
  }
  for (int root = 0; root < static_cast<int>(seen.size()); ++root) {
    if (seen[root] || !welded[root]) continue;
    const Group group(description, welds, in_tree, root);
    const bool merge = group.IsOneBody();
    for (const int body : group.bodies()) {
      seen[body] = true;
      if (merge && body != root) attachments[body] = group.at(body);
    }
  }
  return attachments;
}

}  // namespace loopbench
