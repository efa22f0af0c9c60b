// explain: the contents of a mechanism file, with its own numbers.
#include "harness/cli/commands.h"
#include "mechanism/model/mechanism.h"

namespace loopbench::harness {
namespace {

using Eigen::Vector3d;

std::string VectorText(const Vector3d& v, SpaceKind space) {
  return space == SpaceKind::kPlanar ? Spaced(Eigen::Vector2d(v.head<2>())) : Spaced(v);
}

/// Returns "tip (1 0)" if a point of the body has this place, else "(1 0)".
std::string Place(const BodyDescription& body, const Vector3d& at, SpaceKind space) {
  std::string text = fmt::format("({})", VectorText(at, space));
  for (const auto& [name, point] : body.points) {
    if (point == at) return fmt::format("{} {}", name, text);
  }
  return text;
}

Table BodyTable(const MechanismDescription& description, const Structure& structure) {
  Table table{.columns = Columns("name=body, part=subsystem:integer, mass=mass [kg]:shortest, "
                                 "inertia=inertia [kg m^2], com=com [m], points=points [m]")};
  const bool planar = description.space == SpaceKind::kPlanar;
  const auto add = [&](const BodyDescription& body) -> Record& {
    Record& row = table.rows.emplace_back();
    row.Set("name", body.name);
    row.Set("points", Joined(body.points, ", ", [&](const auto& point) {
              return fmt::format("{} ({})", point.first,
                                 VectorText(point.second, description.space));
            }));
    return row;
  };
  add(description.bodies[kGround]);
  for (std::size_t i = 0; i < structure.islands.size(); ++i) {
    for (const int index : structure.islands[i].bodies) {
      const BodyDescription& body = description.bodies[index];
      Record& row = add(body);
      const Eigen::Matrix3d& I = body.inertia;
      const Vector3d products(I(0, 1), I(0, 2), I(1, 2));
      std::string inertia = planar ? ShortNumber(I(2, 2)) : Spaced(Vector3d(I.diagonal()));
      if (!planar && !products.isZero(0.0)) inertia += " " + Spaced(products);
      Put(row, "part", i + 1, "mass", body.mass, "inertia", inertia, "com",
          VectorText(body.com, description.space));
    }
  }
  return table;
}

std::string FunctionText(const TimeFunctionDescription& function) {
  if (const auto* polynomial = std::get_if<Polynomial>(&function)) {
    return Joined(polynomial->coefficients, " + ", [power = 0](double number) mutable {
      const std::string text = ShortNumber(number);
      const int i = power++;
      return i == 0 ? text : i == 1 ? text + " t" : fmt::format("{} t^{}", text, i);
    });
  }
  if (const auto* harmonic = std::get_if<Harmonic>(&function)) {
    return fmt::format("{} + {} sin({} t + {})", ShortNumber(harmonic->mean),
                       ShortNumber(harmonic->amplitude), ShortNumber(harmonic->omega),
                       ShortNumber(harmonic->phase));
  }
  const TimeTable& table = std::get<TimeTable>(function);
  return fmt::format("table of {} points, t = {} to {} s, {}", table.times.size(),
                     ShortNumber(table.times.front()), ShortNumber(table.times.back()),
                     table.cubic ? "cubic" : "straight lines");
}

/// Returns parameters, the rotor and prescribed motions.
std::string Given(SpaceKind space, const JointDescription& joint) {
  std::vector<std::string> given;
  const JointParameter& own = TraitsOf(joint.type).parameter;
  if (!own.key.empty()) {
    AddNote(given, "{} {} {}", own.key, ShortNumber(joint.parameter), own.unit);
  }
  const std::vector<ValueWord> words = ValueWords(joint.type, space, false);
  if (joint.rotor_inertia > 0.0) {
    AddNote(given, "rotor {} {}", ShortNumber(joint.rotor_inertia),
            words.at(0).is_length() ? "kg" : "kg m^2");
  }
  for (const PrescribedMotion& motion : joint.motions) {
    const ValueWord& word = words.at(static_cast<std::size_t>(motion.coordinate));
    AddNote(given, "{} = {} [{}]", word.name, FunctionText(motion.value), word.unit);
  }
  return Joined(given, "; ");
}

Table JointTable(const MechanismDescription& description, const Structure& structure) {
  Table table{
      .columns = Columns(
          "name=joint, type, from, to, free:integer, rows=constrains:integer, place, given")};
  const int dim = description.space == SpaceKind::kPlanar ? 3 : 6;
  std::vector<bool> cut(description.joints.size());
  for (const LoopPath& loop : structure.loops) cut[loop.cut_joint] = true;
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    const JointDescription& joint = description.joints[j];
    // directions of its kind without those with a given motion
    const int kind = dim == 3 && TraitsOf(joint.type).in_plane
                         ? KindOf<Planar, double>(joint.type).num_u
                         : KindOf<Spatial, double>(joint.type).num_u;
    const int free = kind - static_cast<int>(joint.motions.size());
    AddRow({joint.name, joint.type, description.bodies[joint.from.body].name,
            description.bodies[joint.to.body].name, free, dim - free,
            cut[j] ? "closes a loop" : "tree", Given(description.space, joint)},
           &table);
  }
  return table;
}

/// Round-off of a direction after a turn by pi/2.
constexpr double kRoundOff = 1e-14;

/// Returns the free axes of a joint's frame (translations or rotations), in body axes.
template <class Space>
std::string AxesText(const Rotation<Space, double>& R, std::string_view axes) {
  std::string text;
  for (const char axis : axes) {
    auto direction = R.col(axis - 'x').eigen();
    for (double& part : direction) {
      if (std::abs(part) < kRoundOff) part = 0.0;
    }
    text += fmt::format("{}{} = ({})", text.empty() ? "" : ", ", axis, Spaced(direction));
  }
  return text;
}

template <class Space>
Table FrameTable(const MechanismDescription& description) {
  Table table{.columns = Columns("name=joint, side=frame, body=on body, at=origin [m], axes=axis, "
                                 "turn=rotation vector [rad]")};
  const Mechanism<Space, double> mechanism(description, Coordinates::kJoint);
  for (std::size_t j = 0; j < description.joints.size(); ++j) {
    const JointDescription& joint = description.joints[j];
    const JointTraits& traits = TraitsOf(joint.type);
    const bool planar = description.space == SpaceKind::kPlanar;
    const SideWords& axes = planar ? traits.planar_axes : traits.axes;
    for (const bool from : {true, false}) {
      const JointSide& side = from ? joint.from : joint.to;
      const Pose<Space, double>& X = from ? mechanism.joints()[j].X_PF : mechanism.joints()[j].X_QM;
      const BodyDescription& body = description.bodies[side.body];
      Record& row = table.rows.emplace_back();
      if (from) row.Set("name", joint.name);
      // for programs, the joint in every row
      Put(row, "joint", joint.name, "side", from ? "F, from" : "M, to", "body", body.name, "at",
          Place(body, side.position, description.space), "axes",
          AxesText<Space>(X.R, from ? axes.from : axes.to));
      const auto turn = RotationVector(X).eigen();
      if (joint.type != JointType::kRod && !turn.isZero(0.0)) row.Set("turn", Spaced(turn));
    }
  }
  return table;
}

Table ForceTable(const MechanismDescription& description) {
  Table table{.columns = Columns("type=force, on=acts on, with")};
  for (ForceDescription force : description.forces) {
    const ForceParts parts = PartsOf(force);
    std::vector<std::string> on, with;
    bool is_length = true;
    if (parts.joint != nullptr) {
      const JointDescription& joint = description.joints[*parts.joint];
      on.push_back("joint " + joint.name);
      is_length = ValueWords(joint.type, description.space, false).at(0).is_length();
    }
    for (const BodyPoint* point : parts.points) {
      const BodyDescription& body = description.bodies[point->body];
      on.push_back(body.name + " at " + Place(body, point->at, description.space));
    }
    if (parts.value != nullptr) {
      AddNote(with, "{} [{}]", FunctionText(*parts.value), quantity::kEffort.Unit(is_length));
    }
    if (parts.force != nullptr) {
      AddNote(with, "force ({}) N in {} axes", VectorText(*parts.force, description.space),
              *parts.in_body_axes ? "body" : "ground");
    }
    for (const ForceNumber& number : parts.numbers) {
      AddNote(with, "{} {} {}", number.key, ShortNumber(*number.value),
              number.quantity.Unit(is_length));
    }
    AddRow({parts.name, Joined(on, ", "), Joined(with, ", ")}, &table);
  }
  return table;
}

Table CouplingTable(const MechanismDescription& description) {
  Table table{.columns = Columns("name=coupling, relation")};
  for (const CouplingDescription& coupling : description.couplings) {
    const std::string text = Joined(coupling.parts, " + ", [&](const auto& part) {
      return ShortNumber(part.ratio) + " " + description.joints[part.joint].name;
    });
    AddRow({coupling.name, fmt::format("{} = {}", text, ShortNumber(coupling.offset))}, &table);
  }
  return table;
}

}  // namespace

void PrintModel(const MechanismDescription& description, const Structure& structure,
                const ExplainView& view) {
  const bool planar = description.space == SpaceKind::kPlanar;
  view.Print("  gravity ({}) m/s^2 in ground axes\n",
             VectorText(description.gravity, description.space));
  PrintSection("Bodies", BodyTable(description, structure), view, "bodies");
  view.Print("  Points and com are relative to the body's origin; inertia is about com.\n");
  if (!planar) view.Print("  Inertia is Ixx Iyy Izz, and Ixy Ixz Iyz unless zero.\n");
  PrintSection("Joints", JointTable(description, structure), view, "joints");
  PrintSection("Frames of joints",
               planar ? FrameTable<Planar>(description) : FrameTable<Spatial>(description), view,
               "frames");
  view.Print(
      "  Origin, axis and rotation vector are in body axes. Coordinates describe M relative to "
      "F.\n");
  if (!description.couplings.empty()) {
    PrintSection("Couplings of joint coordinates", CouplingTable(description), view, "couplings");
  }
  PrintSection("Forces", ForceTable(description), view, "forces");
}

}  // namespace loopbench::harness
