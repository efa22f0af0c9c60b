// "output" of an experiment file: which rows a trajectory has.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "harness/config/experiment_sections.h"

namespace loopbench::harness {
namespace {

constexpr int kMostRows = 100'000'000;  // some 50 GB of a small mechanism
constexpr const char* kOneWay =
    "one of \"step\", \"number\", \"times\" and \"accepted_steps\": true";

int WaysOf(const OutputOptions& output) {
  return (output.step > 0.0) + (output.number > 0) + !output.times.empty() + output.accepted_steps;
}

/// Reports times that are said twice or not at all, or do not rise.
void RequireOneWay(const JsonNode& node, OutputOptions& output) {
  // a value that is wrong by itself has been reported
  const bool said = node.Optional("step") || node.Optional("number") || node.Optional("times");
  if (WaysOf(output) > 1) return node.FailAs("several ways to say times", kOneWay);
  if (WaysOf(output) == 0 && !said) return node.FailAs("no times", kOneWay);
  if (!std::ranges::is_sorted(output.times, std::ranges::less_equal())) {
    node.Optional("times")->FailAs("times that do not rise", "each later than the one before");
  }
  if (output.exact && output.accepted_steps) {
    node.FailAs("\"exact\" beside \"accepted_steps\"",
                "one of them: the ends of steps are exact as they are");
  }
}

Json OneWaySchema() {
  Json ways = Json::array();
  for (const char* key : {"step", "number", "times"}) ways.push_back(Requires({key}));
  ways.push_back(
      {{"required", {"accepted_steps"}}, {"properties", {{"accepted_steps", {{"const", true}}}}}});
  return {{"oneOf", ways}};
}

}  // namespace

const Fields<OutputOptions>& OutputFields() {
  static const Fields<OutputOptions> fields(
      "output",
      "A trajectory of each case, as CSV beside the store. One of step, number, times and "
      "accepted_steps says when.",
      {{"step", Number(&OutputOptions::step, kPositive), "From row to row [s], from 0."},
       {"number", Integer(&OutputOptions::number, 2, kMostRows),
        "Of rows, evenly from the start to the end."},
       {"times", NumberList(&OutputOptions::times, {.min = 0.0}),
        "Rising [s]; those beyond a horizon are left out."},
       {"accepted_steps", Bool(&OutputOptions::accepted_steps),
        "A row for the end of each step of the integrator."},
       {"exact", Bool(&OutputOptions::exact),
        "Steps end at the times, which makes another run; else rows lie on dense output, and the "
        "run is the same as without."},
       {"quantities",
        Choices(&OutputOptions::quantities, NamesOf<OutputPart>(), "a part of a trajectory"),
        "What rows hold; default: all."},
       {"axes", Choice(&OutputOptions::axes, NamesOf<OutputAxes>(), "axes"),
        "Of reactions: those of the ground, or of each joint's frame on its first body."},
       {"", By(OneWaySchema(), RequireOneWay)}});
  return fields;
}

void RequireOutput(const JsonNode& node, ExperimentFile& file) {
  const auto output = node.Optional("output");
  if (!output || !file.output) return;
  if (file.compile.islands) {
    output->FailAs("output of parts that run on their own",
                   "\"islands\": false in \"compile\": rows are of the whole mechanism");
  }
  double longest = 0.0;
  for (const ExperimentScene& scene : file.scenes) {
    for (const double horizon : scene.horizons) longest = std::max(longest, horizon);
  }
  if (file.output->step > 0.0 && longest / file.output->step > kMostRows) {
    output->FailAs(fmt::format("{:.3g} rows", longest / file.output->step),
                   fmt::format("at most {}", kMostRows));
  }
  for (const Column& column : file.columns) {
    const FormulationRow* row = FindFormulation(column.formulation);
    if (row == nullptr || !row->is_peer() || file.output->accepted_steps) continue;
    return output->FailAs(
        fmt::format("output at given times of \"{}\", which has its own integrator", row->name),
        "\"accepted_steps\": true");
  }
}

bool OutputOptions::Has(OutputPart part) const {
  return std::ranges::find(quantities, part) != quantities.end();
}

std::vector<double> OutputTimes(const OutputOptions& output, double horizon) {
  std::vector<double> times;
  if (output.number > 0) {
    for (int i = 0; i < output.number; ++i) times.push_back(horizon * i / (output.number - 1));
  } else if (output.step > 0.0) {
    // a last row that rounding has carried beyond the end is the end
    const double rows = horizon / output.step;
    const double last = std::floor(rows * (1 + 4 * std::numeric_limits<double>::epsilon()));
    for (std::int64_t i = 0; i <= static_cast<std::int64_t>(last); ++i) {
      times.push_back(std::min(horizon, output.step * static_cast<double>(i)));
    }
  } else {
    for (const double t : output.times) {
      if (t <= horizon) times.push_back(t);
    }
  }
  return times;
}

std::string ToString(const OutputOptions& output) {
  std::string text =
      fmt::format("{} {} {} {}", output.step, output.number, output.accepted_steps, output.exact);
  for (const double t : output.times) text += fmt::format(" {}", t);
  for (const OutputPart part : output.quantities) {
    text += fmt::format(" {}", kNames<OutputPart>[static_cast<std::size_t>(part)]);
  }
  return text + fmt::format(" {}", kNames<OutputAxes>[static_cast<std::size_t>(output.axes)]);
}

}  // namespace loopbench::harness
