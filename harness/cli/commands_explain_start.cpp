// explain: the assembled start of a mechanism, joint by joint, and its energy.
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "harness/cli/commands_explain.h"
#include "harness/text/terminal.h"
#include "mechanism/model/kinematics.h"

namespace loopbench::harness {

namespace {

template <class Space>
class StartText {
 public:
  StartText(const MechanismDescription& description, const Start<double>& start)
      : description_(description),
        start_(start),
        mechanism_(description, Coordinates::kJoint),
        kinematics_(mechanism_) {
    kinematics_.UpdatePosition(start.q);
    kinematics_.UpdateVelocity(start.u);
  }

  Table JointValuesTable() const {
    Table table;
    table.columns = {
        {"name", "joint", Format::kText, {}}, {"coordinate", "coordinate", Format::kText, {}},
        {"q", "value", Format::kText, {}},    {"speed", "speed", Format::kText, {}},
        {"u", "value", Format::kText, {}},    {"given", "given", Format::kText, {}}};
    for (std::size_t j = 0; j < description_.joints.size(); ++j) AddJoint(j, &table);
    return table;
  }

  Energy<double> EnergyAtStart() const { return ComputeEnergy(kinematics_); }

 private:
  using Values = std::array<double, 7>;

  /// Of a tree joint as they are integrated; of others as measured between the bodies.
  Values CoordinatesOf(const Joint<Space, double>& joint) const {
    Values q{};
    if (joint.kind->coordinates == nullptr) return q;
    const Pose<Space, double> X_WF = Compose(kinematics_.poses()[joint.from], joint.X_PF),
                              X_WM = Compose(kinematics_.poses()[joint.to], joint.X_QM);
    joint.kind->coordinates(Compose(Inverse(X_WF), X_WM), q.data(), joint.kind->parameter);
    for (int i = 0, next = joint.q_offset; i < joint.kind->num_q; ++i) {
      const int drive = mechanism_.DriveOf(joint, i);
      if (drive >= 0) {
        q[i] = kinematics_.drives()[drive].value;
      } else if (joint.in_tree()) {
        q[i] = start_.q[next++];
      }
    }
    return q;
  }

  Values SpeedsOf(std::size_t index) const {
    Values u{};
    const Joint<Space, double>& joint = mechanism_.joints()[index];
    const JointState<Space, double>& state = kinematics_.joints()[index];
    for (int i = 0, next = 0; i < joint.kind->num_u; ++i) {
      const int drive = mechanism_.DriveOf(joint, i);
      u[i] = drive >= 0 ? kinematics_.drives()[drive].rate
                        : joint.kind->inverse_H_squared * state.H(next++).dot(state.V_rel);
    }
    return u;
  }

  std::string GivenBy(int joint) const {
    const InitialDescription& initial = description_.initial;
    if (!description_.joints[joint].motions.empty()) return "prescribed";
    std::string text;
    const auto has = [joint](const std::vector<JointValues>& list) {
      return std::ranges::find(list, joint, &JointValues::joint) != list.end();
    };
    if (std::ranges::find(initial.held, joint) != initial.held.end()) {
      text = "held";
    } else if (has(initial.coordinates)) {
      text = "guessed";
    }
    if (has(initial.speeds)) text += text.empty() ? "speed" : ", speed";
    return text;
  }

  void AddJoint(std::size_t index, Table* table) const {
    const JointType type = description_.joints[index].type;
    const std::vector<ValueWord> positions = ValueWords(type, description_.space, false),
                                 speeds = ValueWords(type, description_.space, true);
    const Values q = CoordinatesOf(mechanism_.joints()[index]), u = SpeedsOf(index);
    const auto with_unit = [](double value, std::string_view unit) {
      return fmt::format("{}{}{}", ShortNumber(value), unit.empty() ? "" : " ", unit);
    };
    for (std::size_t i = 0; i < positions.size(); ++i) {
      Record& row = table->rows.emplace_back();
      row.Set("joint", description_.joints[index].name);  // for programs, in every row
      if (i == 0) {
        row.Set("name", description_.joints[index].name);
        row.Set("given", GivenBy(static_cast<int>(index)));
      }
      row.Set("coordinate", std::string(positions[i].name));
      row.Set("q", with_unit(q[i], positions[i].unit));
      if (i >= speeds.size()) continue;
      row.Set("speed", std::string(speeds[i].name));
      row.Set("u", with_unit(u[i], speeds[i].unit));
    }
  }

  const MechanismDescription& description_;
  const Start<double>& start_;
  Mechanism<Space, double> mechanism_;
  Kinematics<Space, double> kinematics_;
};

template <class Space>
void PrintOf(const MechanismDescription& description, const Start<double>& start,
             const ExplainView& view) {
  const StartText<Space> text(description, start);
  const bool closed = start.outcome != Outcome::kInconsistentStart;
  PrintSection(closed ? "Start as assembled, t = 0" : "Start, where the assembly gave up",
               text.JointValuesTable(), view, "start");
  if (!closed) return;
  const Energy<double> energy = text.EnergyAtStart();
  if (view.document != nullptr) {
    view.document->Add("energy", JsonObject()
                                     .Add("kinetic", energy.kinetic)
                                     .Add("potential", energy.potential)
                                     .Add("total", energy.total()));
  }
  Say(view, "  Energy: kinetic {} J + potential {} J = {} J\n", ShortNumber(energy.kinetic),
      ShortNumber(energy.potential), ShortNumber(energy.total()));
  Say(view,
      "  Potential 0: coms and constant forces in the ground origin, springs at rest, joint\n");
  Say(view, "  torques at coordinate 0.\n");
}

}  // namespace

void PrintStart(const MechanismDescription& description, const Structure& structure,
                const ExplainView& view) {
  if (description.space == SpaceKind::kPlanar) {
    PrintOf<Planar>(description, structure.start, view);
  } else {
    PrintOf<Spatial>(description, structure.start, view);
  }
}

}  // namespace loopbench::harness
