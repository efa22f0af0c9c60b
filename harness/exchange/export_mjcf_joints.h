// Tree joints as chains of MuJoCo's joints, all of one body.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "harness/exchange/model.h"
#include "mechanism/description/joint_frames.h"

namespace loopbench::exchange {

/// A slide or hinge along or about an axis of the moved body, or a ball.
struct MjcfPart {
  char kind = 'h';       ///< 's', 'h', 'b'
  int coordinate = 0;    ///< the joint's; of a ball the first
  Eigen::Vector3d axis;  ///< in the axes of the body, as it is put
  Eigen::Vector3d at;    ///< a point of the axis, from the body's origin
  double value = 0.0;    ///< where the body is put: MuJoCo's coordinate; 0 of a ball
};

struct MjcfChain {
  loopbench::Frame pose;        ///< of the body in its parent, both from their origins
  std::vector<MjcfPart> parts;  ///< in MuJoCo's order
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  ///< of a ball, from its fixed frame
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< of the moved joint frame, in the body
};

/// Whether MuJoCo has such a joint in a tree.
bool HasParts(const Joint& joint);

/// A tree joint of the model where Model::q puts it. A joint seen from its other side is its parts
/// in the other order with opposite coordinates.
MjcfChain ChainOf(const Model& model, const Joint& joint);

/// Frames of the model from the user's origin of their body.
loopbench::Frame FromOrigin(const Model& model, int body, const Frame& frame);
Eigen::Vector3d FromOrigin(const Model& model, int body, const Vec& at);

/// w, x, y, z.
std::array<double, 4> QuaternionOf(const Eigen::Matrix3d& R);

}  // namespace loopbench::exchange
