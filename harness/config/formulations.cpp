#include "harness/config/formulations.h"

#include <array>

#include "harness/base/text.h"
#include "lagrange/lagrange.h"
#include "mechanism/description/registration.h"
#include "odca/odca.h"
#include "reduction/reduction.h"

namespace loopbench::harness {
namespace {

/// Returns the row of a peer, whose states are evaluated by O-DCA.
FormulationRow PeerRow(std::string name, std::string sentence, Enforcement like,
                       std::string integrator, std::string color, bool is_soft = false) {
  FormulationRow row = Row<odca::Odca>(std::move(name), std::move(sentence), std::move(color));
  row.levels = {like};
  row.integrator = std::move(integrator);
  row.is_soft = is_soft;
  return row;
}

/// Returns built-in formulations, peers last. Colours (P. Tol) also differ in lightness.
std::deque<FormulationRow> BuiltIn() {
  return {
      Row<odca::Odca>("odca",
                      "orthogonal-complement divide and conquer: bodies are assembled pairwise, "
                      "loop forces result from the assembly.",
                      "#004488"),
      Row<lagrange::Lagrange>("lagrange",
                              "Lagrange multipliers: one per constraint, from one linear system.",
                              "#BB5566"),
      Row<reduction::Reduction>(
          "reduction",
          "coordinate reduction: independent speeds; the others follow from the constraints.",
          "#DDAA33"),
      PeerRow("peer/simbody",
              "the library Simbody with its own integrator; it projects positions and speeds "
              "after each step, to a tenth of the tolerance.",
              Enforcement::kPosition, "simbody-merson", "#117733"),
      PeerRow("peer/mujoco",
              "the library MuJoCo with a fixed step that follows from the tolerance; its loop "
              "constraints are springs and dampers.",
              Enforcement::kBaumgarte, "mujoco-rk4", "#88CCEE", true)};
}

/// Colours for rows without a colour, in turn.
constexpr std::array kFreeColors = {"#AA4499", "#332288", "#999933"};

std::deque<FormulationRow>& Rows() {
  static std::deque<FormulationRow> rows = BuiltIn();
  return rows;
}

bool IsColor(std::string_view text) {
  return text.size() == 7 && text.front() == '#' &&
         text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string_view::npos;
}

constexpr const char* kKind = "formulation";  // of a NewRow

}  // namespace

bool FormulationRow::Has(Enforcement level) const {
  return levels.empty() || std::ranges::find(levels, level) != levels.end();
}

void RegisterFormulation(FormulationRow row, int alignment) {
  RequireSound({.kind = kKind,
                .name = row.name,
                .is_taken = FindFormulation(row.name) != nullptr,
                .has_sentence = !row.sentence.empty(),
                .has_factories = row.planar && row.spatial,
                .alignment = alignment});
  if (row.color.empty()) {
    row.color = kFreeColors[(Rows().size() - BuiltIn().size()) % kFreeColors.size()];
  }
  if (!IsColor(row.color)) {
    RefuseRow(kKind, row.name, fmt::format("colour \"{}\"", row.color), "#RRGGBB, or none");
  }
  Rows().push_back(std::move(row));
}

const std::deque<FormulationRow>& Formulations() { return Rows(); }

std::vector<std::string> FormulationNames() {
  return Mapped<std::string>(Rows(), &FormulationRow::name);
}

std::vector<std::string> FormulationNamesWithoutPeers() {
  std::vector<std::string> names = FormulationNames();
  std::erase_if(names, [](const std::string& name) { return FindFormulation(name)->is_peer(); });
  return names;
}

const FormulationRow* FindFormulation(std::string_view name) {
  const auto row = std::ranges::find(Rows(), name, &FormulationRow::name);
  return row == Rows().end() ? nullptr : &*row;
}

template <class Space>
std::unique_ptr<System<Space, double>> MakeFormulation(std::string_view name,
                                                       const Mechanism<Space, double>& mechanism,
                                                       const FormulationOptions& options) {
  const FormulationRow* row = FindFormulation(name);
  if (row == nullptr) {
    RefuseRow(kKind, name, "no such name",
              fmt::format("one of {}", fmt::join(FormulationNames(), ", ")));
  }
  if (!row->Has(options.enforcement)) {
    RefuseRow(kKind, row->name, ToString(options.enforcement), "a level that it has");
  }
  FormulationOptions own = options;
  if (row->is_peer()) own.enforcement = Enforcement::kAcceleration;
  std::unique_ptr<ConstraintSolver<Space, double>> solver;
  if constexpr (std::is_same_v<Space, Planar>) {
    solver = row->planar(mechanism, own);
  } else {
    solver = row->spatial(mechanism, own);
  }
  return std::make_unique<System<Space, double>>(mechanism, std::move(solver), own);
}

template std::unique_ptr<System<Planar, double>> MakeFormulation(std::string_view,
                                                                 const Mechanism<Planar, double>&,
                                                                 const FormulationOptions&);
template std::unique_ptr<System<Spatial, double>> MakeFormulation(std::string_view,
                                                                  const Mechanism<Spatial, double>&,
                                                                  const FormulationOptions&);

}  // namespace loopbench::harness
