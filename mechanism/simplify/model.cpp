#include "mechanism/simplify/model.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "mechanism/simplify/compile.h"
#include "mechanism/simplify/restart.h"

namespace loopbench {

namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

/// Returns one simplification of compile.h as a separate model.
Simplified Exactly(const MechanismDescription& description, bool CompileOptions::*saving) {
  CompileOptions options = CompileOptions::None();
  options.*saving = true;
  Compiled compiled = Compile(description, options);
  Simplified result;
  for (CompiledPart& part : compiled.parts) result.parts.push_back(std::move(part.description));
  result.R_WC = compiled.parts.front().R_WC;
  if (!(compiled.done.*saving)) {
    result.why_not = compiled.report.empty() ? kNothingOfTheKind : compiled.report[0];
    return result;
  }
  for (const std::string& sentence : compiled.report) {
    (sentence.ends_with(" dropped") ? result.dropped : result.done).push_back(sentence);
  }
  for (const std::string& sentence : result.done) {
    result.candidates.push_back({sentence, kNoNumber, true, ""});
  }
  return result;
}

Simplified MadePlanar(const MechanismDescription& description, const ShortRun&,
                      const SimplifyOptions&) {
  Simplified result = Exactly(description, &CompileOptions::planar);
  if (description.space == SpaceKind::kPlanar) result.why_not = "it is planar already";
  return result;
}

template <bool CompileOptions::*saving>
Simplified Exact(const MechanismDescription& description, const ShortRun&, const SimplifyOptions&) {
  return Exactly(description, saving);
}

/// A part that cannot move by itself is no model: a run of it would end as locked.
Simplified Apart(const MechanismDescription& description, const ShortRun&, const SimplifyOptions&) {
  Simplified result = Exactly(description, &CompileOptions::islands);
  if (!result.applies()) return result;
  std::erase_if(result.parts, [&](const MechanismDescription& part) {
    std::string why;
    AssembledStart(part, &why);
    if (!why.empty()) result.dropped.push_back(why);
    return !why.empty();
  });
  if (result.parts.empty()) result.why_not = "no part of it moves by itself";
  return result;
}

/// Files cannot hold constraints released by runs.
Simplified Redundant(const MechanismDescription& description, const ShortRun&,
                     const SimplifyOptions&) {
  Simplified result = Exactly(description, &CompileOptions::redundancy);
  result.parts = {description};
  if (!result.applies()) return result;
  result.done.clear();
  for (Candidate& candidate : result.candidates) candidate.taken = false;
  result.why_not =
      "a mechanism file cannot contain single constraints of a joint: runs remove them themselves "
      "(\"preprocess\", \"redundancy\")";
  return result;
}

/// An approximate rule, for mechanisms without couplings and rotors.
template <Simplified (*rule)(const MechanismDescription&, const ShortRun&, const SimplifyOptions&)>
Simplified Uncoupled(const MechanismDescription& description, const ShortRun& run,
                     const SimplifyOptions& options) {
  const bool has_rotor = std::ranges::any_of(
      description.joints, [](const JointDescription& joint) { return joint.rotor_inertia > 0.0; });
  if (description.couplings.empty() && !has_rotor) return rule(description, run, options);
  Simplified result;
  result.parts = {description};
  result.why_not = "the rule does not support couplings and rotors";
  return result;
}

/// Appends the result of a rule on the last model, if it applies.
void Append(const SimplificationRule& idea, const ShortRun& run, const SimplifyOptions& options,
            Simplified* model) {
  Simplified next = idea.apply(model->parts.front(), run, options);
  if (!next.applies() || next.parts.size() > 1) return;
  model->parts = std::move(next.parts);
  if (std::ranges::find(model->ideas, &idea) == model->ideas.end()) {
    model->ideas.push_back(&idea);
  }
  model->R_WC = (model->R_WC * next.R_WC).eval();
  for (auto [from, to] : {std::pair{&next.done, &model->done}, {&next.dropped, &model->dropped}}) {
    for (std::string& sentence : *from) to->push_back(std::string(idea.name) + ": " + sentence);
  }
}

}  // namespace

const std::vector<SimplificationRule>& SimplificationRules() {
  static const std::vector<SimplificationRule> ideas = {
      {.name = "welds",
       .is_exact = true,
       .sentence = "bodies joined by welds become one body",
       .apply = Exact<&CompileOptions::welds>},
      {.name = "immovable",
       .is_exact = true,
       .sentence = "bodies that cannot move become part of the ground",
       .apply = Exact<&CompileOptions::immovable>},
      {.name = "redundancy",
       .is_exact = true,
       .sentence = "constraints that others imply at every position are removed",
       .apply = Redundant},
      {.name = "planar",
       .is_exact = true,
       .sentence = "a spatial mechanism that moves in parallel planes becomes planar",
       .apply = MadePlanar},
      {.name = "constant-parts",
       .sentence = "bodies that hardly move relative to each other become one body",
       .assumption = "their joints stay at rest after the trial run",
       .number = "relative motion in the trial run [rad, or mechanism lengths]",
       .limit = &SimplifyOptions::constant_parts,
       .apply = Uncoupled<FreezeConstantParts>},
      {.name = "stiff-springs",
       .sentence = "springs much faster than the motion become rods or locked joints",
       .assumption = "nothing excites them: they stay at their rest position",
       .number = "frequency divided by the rate of the motion",
       .limit = &SimplifyOptions::stiff_springs,
       .is_least = true,
       .apply = Uncoupled<HoldStiffSprings>},
      {.name = "light-links",
       .sentence = "links of small mass become massless rods; their mass moves to their ends",
       .assumption = "the rotational energy of the link is negligible",
       .number = "largest share of the kinetic energy in any motion at the start",
       .limit = &SimplifyOptions::light_links,
       .apply = Uncoupled<LightenLinks>},
      {.name = "nearly-planar",
       .sentence = "a mechanism that nearly moves in parallel planes becomes planar",
       .assumption = "the tilt of the axes stays as small as at the start",
       .number = "tilt of the axes at the start (sine)",
       .limit = &SimplifyOptions::nearly_planar,
       .apply = Uncoupled<FlattenNearly>},
      {.name = "islands",
       .is_exact = true,
       .sentence = "parts without a connection become separate models",
       .apply = Apart},
  };
  return ideas;
}

Simplified Combine(const MechanismDescription& description,
                   const std::vector<const SimplificationRule*>& ideas, const ShortRun& run,
                   const SimplifyOptions& options) {
  if (const std::string error = Validate(description); !error.empty()) {
    throw std::invalid_argument(error);
  }
  Simplified model;
  model.parts = {description};
  for (const SimplificationRule* idea : ideas) Append(*idea, run, options, &model);
  // simplified bodies may allow further welds and immovable bodies
  for (const SimplificationRule* idea : ideas) {
    if (idea->is_exact && !model.ideas.empty()) Append(*idea, run, options, &model);
  }
  if (model.ideas.empty()) model.why_not = "no rule applies";
  return model;
}

FoundPoint FindPoint(const MechanismDescription& simplified, const std::string& body,
                     const std::string& point) {
  const std::string attached = body + "." + point;
  FoundPoint found;
  for (std::size_t b = 0; b < simplified.bodies.size(); ++b) {
    const BodyDescription& one = simplified.bodies[b];
    const bool is_body = b != kGround && one.name == body;
    for (const auto& [name, at] : one.points) {
      const bool same =
          is_body ? name == point : name == attached || name.ends_with("." + attached);
      if (same) found = {static_cast<int>(b), at};
    }
  }
  return found;
}

}  // namespace loopbench
