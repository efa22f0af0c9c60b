// Models in MuJoCo 2.2 (https://mujoco.org). C++17, as harness/exchange/model.h.
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "harness/exchange/export_mjcf.h"
#include "peers/program.h"

namespace loopbench::peers {
namespace {

using exchange::MjcfClosure;
using exchange::MjcfCoordinate;

/// By default errors end the process after a key press, and warnings go to a file.
void Throw(const char* message) { throw std::runtime_error(message); }
void Ignore(const char*) {}

mjModel* Load(const std::string& document) {
  mju_user_error = Throw;
  mju_user_warning = Ignore;
  constexpr const char* kName = "model.xml";
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  const int size = static_cast<int>(document.size());
  if (mj_makeEmptyFileVFS(files.get(), kName, size) != 0) Throw("no room for the model");
  std::memcpy(files->filedata[0], document.data(), document.size());
  char error[500] = "";
  mjModel* model = mj_loadXML(kName, files.get(), error, sizeof error);
  mj_deleteVFS(files.get());
  if (model == nullptr) Throw(error);
  return model;
}

struct Delete {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};

class MujocoProgram final : public Program {
 public:
  explicit MujocoProgram(const exchange::Model& model)
      : made_(exchange::MakeMjcf(model)), model_(Load(made_.document)) {
    if (model_->njnt != static_cast<int>(made_.coordinates.size()) ||
        model_->neq != static_cast<int>(made_.closures.size() + model.couplings.size())) {
      Throw("joints or closures were lost");
    }
    SetClosures();
    SetCouplings(model);
    data_.reset(mj_makeData(model_.get()));
    SetTimeStep(1e-3);
  }

  void Derivative(const double* q, const double* u, double* qdot, double* udot) override {
    Set(q, u);
    mj_forward(model_.get(), data_.get());
    ToOurs(data_->qacc, udot);
    for (int j = 0; j < model_->njnt; ++j) {
      const MjcfCoordinate& one = At(j);
      if (one.ball) {
        QuaternionRate(q + one.q, u + one.u, qdot + one.q);
      } else {
        qdot[one.q] = u[one.u];
      }
    }
  }

  void Start(const double* q, const double* u, double tolerance, double t_end) override {
    Set(q, u);
    for (auto& warning : data_->warning) warning.number = 0;
    t_end_ = t_end;
    num_steps_ = std::max<std::int64_t>(
        1, std::llround(std::ceil(t_end / (0.1 * std::pow(tolerance, 0.25)))));
    step_ = 0;
    SetTimeStep(t_end / static_cast<double>(num_steps_));
  }

  void Step() override {
    mj_step(model_.get(), data_.get());
    for (const int kind : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC}) {
      // MuJoCo has returned to its reference pose
      if (data_->warning[kind].number > 0) Throw("unstable: numbers are not finite or too large");
    }
    ++step_;
  }

  double time() const override {
    return step_ == num_steps_ ? t_end_ : static_cast<double>(step_) * model_->opt.timestep;
  }

  void State(double* q, double* u) const override {
    for (int j = 0; j < model_->njnt; ++j) {
      const MjcfCoordinate& one = At(j);
      const double* own = data_->qpos + model_->jnt_qposadr[j];
      q[one.q] = one.ball ? own[0] : one.sign * own[0];
      if (!one.ball) continue;
      mju_rotVecMatT(q + one.q + 1, own + 1, one.axes.data());
      for (int i = 1; i < 4; ++i) q[one.q + i] *= one.sign;
    }
    ToOurs(data_->qvel, u);
  }

  Counts counts() const override { return {step_, 0, 4 * step_, 0}; }

 private:
  const MjcfCoordinate& At(int j) const { return made_.coordinates[static_cast<std::size_t>(j)]; }

  /// Corrects the second points: MuJoCo sets them so that closures hold in its reference pose.
  void SetClosures() {
    for (std::size_t e = 0; e < made_.closures.size(); ++e) {
      const MjcfClosure& closure = made_.closures[e];
      double* data = model_->eq_data + e * mjNEQDATA;
      if (closure.rod >= 0.0) {
        data[0] = closure.rod - model_->tendon_length0[model_->eq_obj1id[e]];
        continue;
      }
      for (std::size_t i = 0; i < 3; ++i) {
        data[i] = closure.at_first[i];
        data[3 + i] = closure.at_second[i];
      }
    }
  }

  /// Corrects constants: MuJoCo's relations hold in its reference pose, and follow the closures.
  void SetCouplings(const exchange::Model& model) {
    double* data = model_->eq_data + made_.closures.size() * mjNEQDATA;
    for (const exchange::Coupling& coupling : model.couplings) {
      double missing = coupling.offset;
      for (const auto& [joint, ratio] : coupling.parts) {
        missing -= ratio * model.q[static_cast<std::size_t>(model.tree[joint].q)];
      }
      const auto& [first, ratio] = coupling.parts[0];
      const double sign = model.tree[first].from_is_child ? -1.0 : 1.0;
      data[0] = coupling.parts.size() == 2 ? sign * missing / ratio : missing;
      data += mjNEQDATA;
    }
  }

  void SetTimeStep(double h) {
    model_->opt.timestep = h;
    for (int e = 0; e < model_->neq; ++e) {
      double *reference = model_->eq_solref + e * mjNREF,
             *impedance = model_->eq_solimp + e * mjNIMP;
      reference[0] = 2.0 * h;  // smallest stable value; critically damped
      reference[1] = 1.0;
      impedance[0] = impedance[1] = mjMAXIMP;
    }
  }

  void Set(const double* q, const double* u) {
    for (int j = 0; j < model_->njnt; ++j) {
      const MjcfCoordinate& one = At(j);
      double* own = data_->qpos + model_->jnt_qposadr[j];
      double* speed = data_->qvel + model_->jnt_dofadr[j];
      if (!one.ball) {
        own[0] = one.sign * q[one.q];
        speed[0] = one.sign * u[one.u];
        continue;
      }
      double turn[4] = {q[one.q]}, w[3];
      for (int i = 1; i < 4; ++i) turn[i] = one.sign * q[one.q + i];
      mju_normalize4(turn);
      own[0] = turn[0];
      mju_rotVecMat(own + 1, turn + 1, one.axes.data());
      // MuJoCo's speeds are in axes of the moved body
      for (int i = 0; i < 3; ++i) w[i] = one.sign * u[one.u + i];
      if (one.sign > 0.0) {
        mju_negQuat(turn, turn);
        mju_rotVecQuat(w, u + one.u, turn);
      }
      mju_rotVecMat(speed, w, one.axes.data());
    }
  }

  /// Converts speeds or accelerations at data_'s pose. A ball's differ only by its orientation,
  /// since w x w = 0.
  void ToOurs(const double* own, double* ours) const {
    for (int j = 0; j < model_->njnt; ++j) {
      const MjcfCoordinate& one = At(j);
      const double* value = own + model_->jnt_dofadr[j];
      if (!one.ball) {
        ours[one.u] = one.sign * value[0];
        continue;
      }
      double w[3];
      if (one.sign > 0.0) {
        mju_rotVecQuat(w, value, data_->qpos + model_->jnt_qposadr[j]);
      } else {
        mju_scl3(w, value, -1.0);
      }
      mju_rotVecMatT(ours + one.u, w, one.axes.data());
    }
  }

  /// Computes half the product of (0, w) and q, w in axes of F.
  static void QuaternionRate(const double* q, const double* w, double* qdot) {
    const double half[] = {0.0, 0.5 * w[0], 0.5 * w[1], 0.5 * w[2]};
    mju_mulQuat(qdot, half, q);
  }

  exchange::Mjcf made_;
  std::unique_ptr<mjModel, Delete> model_;
  std::unique_ptr<mjData, Delete> data_;
  double t_end_ = 0.0;
  std::int64_t step_ = 0, num_steps_ = 0;
};

}  // namespace

std::unique_ptr<Program> MakeMujocoProgram(const exchange::Model& model) {
  return std::make_unique<MujocoProgram>(model);
}

}  // namespace loopbench::peers
