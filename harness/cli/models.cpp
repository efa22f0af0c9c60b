// Models of one problem, their certified motions and errors.
#include "harness/cli/commands.h"
#include "harness/judge/analysis.h"
#include "harness/run/run.h"
#include "harness/suite/advise.h"

#ifdef LOOPBENCH_PRECISIONS
#include "harness/precision/make_reference.h"
#endif

namespace loopbench::harness {
namespace {

void AddModels(const MechanismFile& file, const std::string& name, bool is_exact,
               const std::string& assumption, const Simplified& simplified, ProblemModels* ladder) {
  for (std::size_t part = 0; part < simplified.parts.size(); ++part) {
    ProblemModel model;
    model.name = simplified.parts.size() == 1 ? name : fmt::format("{}-{}", name, part + 1);
    model.is_exact = is_exact;
    model.description = simplified.parts[part];
    model.description.name = fmt::format("{}-{}", file.description.name, model.name);
    const bool same_axes =
        simplified.R_WC.isIdentity(0.0) && model.description.space == file.description.space;
    // exact facts of bodies that still exist; only an exact model in one part has the expected
    // degrees of freedom
    const bool keeps_facts = is_exact && same_axes;
    const auto is_there = [&model](const std::string& body) {
      return Contains(model.description.bodies, body, &BodyDescription::name);
    };
    ObservedQuantities& known = model.observe = file.observe;
    std::erase_if(known.branch_invariants, [&](const AngleCombination& combination) {
      return !keeps_facts || !std::ranges::all_of(combination, [&](const auto& term) {
        return is_there(term.first);
      });
    });
    if (known.closed_form && (!keeps_facts || !is_there(known.closed_form->body))) {
      known.closed_form.reset();
    }
    if (!is_exact || simplified.parts.size() > 1) known.expected.reset();
    model.done = simplified.done;
    model.dropped = simplified.dropped;
    model.assumption = assumption;
    model.R_WC = simplified.R_WC;
    ladder->models.push_back(std::move(model));
  }
}

}  // namespace

ProblemModels MakeModels(const MechanismFile& file,
                         const std::vector<const SimplificationRule*>& ideas, const ShortRun& run,
                         const SimplifyOptions& options) {
  ProblemModels ladder;
  ProblemModel& whole = ladder.models.emplace_back();
  whole.name = "full";
  whole.description = file.description;
  whole.observe = file.observe;
  for (const SimplificationRule* idea : ideas) {
    ladder.ideas.emplace_back(idea, idea->apply(file.description, run, options));
    const Simplified& simplified = ladder.ideas.back().second;
    if (!simplified.applies()) continue;
    AddModels(file, std::string(idea->name), idea->is_exact, std::string(idea->assumption),
              simplified, &ladder);
  }
  const Simplified all = Combine(file.description, ideas, run, options);
  if (all.ideas.size() < 2) return ladder;  // it would equal that rule's model
  std::vector<std::string> assumptions =
      Mapped<std::string>(all.ideas, &SimplificationRule::assumption);
  std::erase(assumptions, "");
  AddModels(file, "combined", std::ranges::all_of(all.ideas, &SimplificationRule::is_exact),
            Joined(assumptions, "; "), all, &ladder);
  return ladder;
}

CertainMotion MakeCertainMotion([[maybe_unused]] const MechanismDescription& user,
                                [[maybe_unused]] double horizon, [[maybe_unused]] double cpu_s,
                                [[maybe_unused]] const std::string& what) {
#ifdef LOOPBENCH_PRECISIONS
  CertainMotion certain{.options = {.scalar = "long-double", .cpu_s = cpu_s}, .horizon = horizon};
  const int all = certain.options.points;
  const auto make = [&] {
    certain.reference = MakeReference(user, certain.horizon, LinkLength(user), certain.options);
    return certain.reference.trust_horizon;
  };
  // a reference is certified up to one of its output times, so the run needs the same times
  constexpr int kFewest = 41, kMaxEnds = 8;
  double end = make();
  for (int i = 0; i < kMaxEnds && end > 0.0 && end < certain.horizon; ++i) {
    const int trusted = static_cast<int>(certain.reference.NumTrusted());
    certain.options.points = trusted < kFewest ? all : trusted;
    certain.horizon = end;
    end = make();
  }
  certain.horizon = end;
  return certain;
#else
  Reject(
      "{} needs certified references: this program was built without wide scalars (cmake "
      "-DLOOPBENCH_PRECISIONS=ON)",
      what);
#endif
}

CausedError ErrorOfModel(const MechanismDescription& whole, const Reference& whole_reference,
                         const ProblemModel& model, const Reference& reference,
                         const std::vector<std::string>& names) {
  CausedError error;
  const std::size_t count = std::min(whole_reference.NumTrusted(), reference.NumTrusted());
  if (count > 0) error.until = whole_reference.times[count - 1];
  for (std::size_t body = 1; body < whole.bodies.size(); ++body) {
    for (const auto& [point, at] : whole.bodies[body].points) {
      const std::string name = whole.bodies[body].name + "." + point;
      if (!names.empty() && !Contains(names, name)) continue;
      const FoundPoint found = FindPoint(model.description, whole.bodies[body].name, point);
      if (found.body < 0) continue;
      ++error.points;
      for (std::size_t k = 0; k < count; ++k) {
        const Frame& X = whole_reference.snapshots[k].bodies[body].pose;
        const Frame& Y = reference.snapshots[k].bodies[found.body].pose;
        const double off = (X.p + X.R * at - model.R_WC * (Y.p + Y.R * found.at)).norm();
        if (off <= error.largest) continue;
        error.largest = off;
        error.point = name;
      }
    }
  }
  return error;
}

}  // namespace loopbench::harness
