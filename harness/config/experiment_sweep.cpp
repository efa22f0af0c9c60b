// Sections of an experiment: sweep, methods, exclusions.
#include <fmt/format.h>

#include <cmath>
#include <set>

#include "harness/config/experiment_reader.h"
#include "harness/config/experiment_sections.h"

namespace loopbench::harness {
namespace {

constexpr std::size_t kMaxAxes = 100;

/// Returns true for letters, digits, "_" and "-" after a letter. Dots are for nested values.
bool IsName(const std::string& text) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return !text.empty() && letter(text.front()) && std::ranges::all_of(text, [&](char c) {
    return letter(c) || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

/// Returns integers only if all values are integers: a table column has one type.
std::vector<Value> AsParameters(const std::vector<Json>& values) {
  constexpr double kLargestExact = 9007199254740992.0;  // 2^53
  const bool integers = std::ranges::all_of(values, [](const Json& value) {
    return value.is_number() && std::trunc(value.get<double>()) == value.get<double>() &&
           std::abs(value.get<double>()) <= kLargestExact;
  });
  std::vector<Value> parameters;
  for (const Json& value : values) {
    if (integers) {
      parameters.emplace_back(static_cast<std::int64_t>(value.get<double>()));
    } else if (value.is_number()) {
      parameters.emplace_back(value.get<double>());
    } else if (value.is_boolean()) {
      parameters.emplace_back(value.get<bool>());
    } else {
      parameters.emplace_back(value.is_string() ? value.get<std::string>() : CompactText(value));
    }
  }
  return parameters;
}

/// Document with the fields of axes, and names of axes so far.
struct AxisContext {
  ExperimentDocument& document;
  std::set<std::string> taken = {};
};

/// Reads the name of an axis, which becomes a key of records.
void ReadAxisName(const JsonNode& node, SweepAxis& axis, AxisContext& context) {
  axis.name = node.Text();
  if (axis.name.empty()) return;
  if (!IsName(axis.name)) {
    node.Fail("a name of letters, digits, \"_\" and \"-\" that begins with a letter");
  } else if (IsReserved(axis.name)) {
    node.Fail("a name that records do not use already");
  } else if (!context.taken.insert(axis.name).second) {
    node.Fail("a name that no other axis has");
  }
}

void ReadField(const JsonNode& node, SweepAxis& axis, AxisContext& context) {
  const std::string pointer = node.Text();
  if (pointer.empty()) return;
  for (const char* own : {"/sweep", "/exclude"}) {
    if (pointer == own || pointer.starts_with(std::string(own) + "/")) {
      node.Fail("a field outside of \"sweep\" and \"exclude\"");
      return;
    }
  }
  axis.fields = context.document.Find(pointer);
  if (!axis.fields.fault) return;
  const FieldFault& fault = *axis.fields.fault;
  if (!fault.of_file) node.FailAs(fault.found, fault.expected, fault.suggestion);
}

void ReadValues(const JsonNode& node, SweepAxis& axis) {
  if (node.value().is_object()) {
    for (const double number : node.Spaced()) axis.values.emplace_back(number);
  } else if (!node.value().is_array() || node.value().empty()) {
    node.Fail("an array of values or a range: {\"lin\" or \"log\": [from, to, count]}");
  } else {
    axis.values.assign(node.value().begin(), node.value().end());
  }
  axis.parameters = AsParameters(axis.values);
}

const Fields<SweepAxis, AxisContext>& AxisFields() {
  static const Json values =
      EitherSchema({ArraySchema(Json::object(), 1), SpacedSchema(NumberSchema(), false)});
  static const Fields<SweepAxis, AxisContext> fields(
      "axis", "Values of one field.",
      {{"name", By(PatternSchema("^[A-Za-z][A-Za-z0-9_-]*$"), ReadAxisName),
        "Key in every record, for filters and tables. It differs from all other keys of records.",
        "a name for tables and filters"},
       {"field", By(PatternSchema("^/(?!sweep(/|$)|exclude(/|$))"), ReadField),
        "JSON Pointer into this file, or through a problem's mechanism path into the mechanism "
        "file. \"*\" stands for all elements of an array.",
        "a JSON Pointer such as /problems/0/horizon"},
       {"values", By(values, ReadValues),
        "Values of any type, each once (in a zip, values may repeat), or a range.",
        "an array of values or a range"}});
  return fields;
}

SweepAxis ReadAxis(const JsonNode& node, AxisContext& context) {
  SweepAxis axis;
  axis.source = node.pointer();
  AxisFields().Read(node, &axis, context);
  return axis;
}

/// Reports repeated combinations, which would repeat cases. 1 and 1.0 are equal.
void CheckDistinct(const JsonNode& node, const SweepGroup& group) {
  std::set<std::string> known;
  for (std::size_t i = 0; i < group.count(); ++i) {
    std::string all;
    for (const SweepAxis& axis : group.axes) {
      const Json& value = axis.values[i];
      const bool is_whole = value.is_number_integer() && value == Json(value.get<double>());
      all += CompactText(Json(CompactText(is_whole ? Json(value.get<double>()) : value)));
    }
    if (known.insert(all).second) continue;
    const std::string values = group.axes.size() == 1 ? CompactText(group.axes.front().values[i])
                                                      : fmt::format("the values number {}", i);
    node.FailAs(values.substr(0, 60) + " again", "each value once");
  }
}

SweepGroup ReadGroup(const JsonNode& node, AxisContext& context) {
  SweepGroup group;
  if (!node.value().is_object() || !node.value().contains("zip")) {
    group.axes.push_back(ReadAxis(node, context));
  } else if (node.ExpectObject({"zip"})) {
    const JsonNode zip = *node.Optional("zip");
    const std::vector<JsonNode> elements = zip.Elements("axes");
    if (zip.value().is_array() && elements.size() < 2)
      zip.FailAs(elements.empty() ? "no axes" : "one axis", "at least two axes");
    for (const JsonNode& element : elements) {
      group.axes.push_back(ReadAxis(element, context));
      const SweepAxis& first = group.axes.front();
      const std::size_t count = group.axes.back().values.size();
      if (count == 0 || first.values.empty() || count == first.values.size()) continue;
      element.FailAs(fmt::format("{} values", count),
                     fmt::format("{}, as many as \"{}\" has", first.values.size(), first.name));
    }
  }
  return group;
}

/// Reports fields that two axes set, or that --set sets in a swept field.
void CheckOverlaps(const JsonNode& node, const std::vector<SweepGroup>& groups,
                   const std::vector<std::string>& settings) {
  // with a final "/" a pointer sorts directly before its children
  std::vector<std::pair<std::string, std::string>> set;
  for (const SweepGroup& group : groups) {
    for (const SweepAxis& axis : group.axes) {
      for (const std::string& pointer : axis.fields.pointers)
        set.emplace_back(pointer + "/", axis.name);
    }
  }
  std::ranges::sort(set);
  for (std::size_t i = 1; i < set.size(); ++i) {
    const auto& [outer, first] = set[i - 1];
    const auto& [inner, second] = set[i];
    if (!inner.starts_with(outer)) continue;
    node.FailAs(fmt::format("\"{}\" and \"{}\" both setting {}", first, second,
                            inner.substr(0, inner.size() - 1)),
                "each field on one axis");
    return;
  }
  for (const std::string& setting : settings) {
    const std::string pointer = setting + "/";
    for (const auto& [field, name] : set) {
      if (!pointer.starts_with(field)) continue;
      node.FailAs(fmt::format("--set {}, which axis \"{}\" sets again", setting, name),
                  "--set for fields that are not swept (or for the values of the axis)");
      return;
    }
  }
}

void ReadSweep(const JsonNode& node, ExperimentDocument& document,
               const std::vector<std::string>& settings, Sweep* sweep) {
  const std::vector<JsonNode> elements = node.Elements("axes");
  if (elements.size() > kMaxAxes) node.Fail(fmt::format("at most {} axes", kMaxAxes));
  if (elements.size() > kMaxAxes || node.errors().full()) return;
  AxisContext context{document};
  double combinations = 1.0;
  for (const JsonNode& element : elements) {
    SweepGroup group = ReadGroup(element, context);
    const bool same = !group.axes.empty() && std::ranges::all_of(group.axes, [&](const auto& axis) {
      return !axis.values.empty() && axis.values.size() == group.count();
    });
    sweep->is_sound = sweep->is_sound && same && std::ranges::none_of(group.axes, [](auto& axis) {
                        return axis.fields.fault.has_value();
                      });
    if (!same) continue;
    CheckDistinct(element, group);
    combinations *= static_cast<double>(group.count());
    sweep->groups.push_back(std::move(group));
  }
  if (!sweep->is_sound) return;
  CheckOverlaps(node, sweep->groups, settings);
  if (combinations > static_cast<double>(kMaxCombinations)) {
    node.FailAs(fmt::format("{:.0f} combinations", combinations),
                fmt::format("at most {}", kMaxCombinations));
    return;
  }
  sweep->count = static_cast<std::size_t>(combinations);
}

// "methods" of an experiment file.

/// Entry of "methods", expanded as a cross product.
struct MethodLists {
  std::vector<std::string> formulations;
  std::vector<Enforcement> enforcements;
  std::vector<Coordinates> coordinates = {Method().coordinates};
  std::vector<SolverKind> solvers = {Method().solver};
  std::optional<BaumgarteGains> gains;
  std::vector<std::int64_t> threads = {Method().threads};
  std::vector<Execution> executions = {Method().execution};
};

/// Reports a level that a formulation does not have.
void RequireLevels(const JsonNode& node, MethodLists& lists) {
  for (const std::string& formulation : lists.formulations) {
    const FormulationRow& row = *FindFormulation(formulation);
    for (const Enforcement level : lists.enforcements) {
      if (row.Has(level)) continue;
      std::vector<std::string_view> levels;
      for (const Enforcement own : row.levels) levels.push_back(ToString(own));
      node.FailAs(fmt::format("\"{}\" at level \"{}\"", formulation, ToString(level)),
                  fmt::format("a level that it has: {}", fmt::join(levels, ", ")));
    }
  }
}

/// Reports options that a peer does not have: it has its own coordinates and solver.
void RequirePeersOwn(const JsonNode& node, MethodLists& lists) {
  for (const std::string& formulation : lists.formulations) {
    if (!FindFormulation(formulation)->is_peer()) continue;
    const auto refuse = [&](std::string_view key, std::string_view found, std::string_view only) {
      node.FailAs(fmt::format("\"{}\" with {} \"{}\"", formulation, key, found),
                  fmt::format("\"{}\", or nothing: a peer has its own", only));
    };
    static const Method kOwn;
    const auto require = [&](std::string_view key, const auto& list, auto own, const auto& text) {
      for (const auto& value : list) {
        if (value != own) refuse(key, text(value), text(own));
      }
    };
    const auto name = [](auto value) { return ToString(value); };
    const auto number = [](std::int64_t value) { return std::to_string(value); };
    require("coordinates", lists.coordinates, kOwn.coordinates, name);
    require("solver", lists.solvers, kOwn.solver, name);
    require("threads", lists.threads, std::int64_t{kOwn.threads}, number);
    require("execution", lists.executions, kOwn.execution, name);
    if (lists.gains) node.FailAs(fmt::format("\"{}\" with gains", formulation), "no gains");
  }
}

/// Reads both gains of Baumgarte stabilisation, or none; other levels have no gains.
void ReadGains(const JsonNode& node, MethodLists& lists) {
  const auto alpha = node.Optional("alpha"), beta = node.Optional("beta");
  if (!alpha && !beta) return;
  const bool only = lists.enforcements == std::vector<Enforcement>{Enforcement::kBaumgarte};
  if (!only) {
    (alpha ? *alpha : *beta)
        .FailAs("gains of another level", "\"enforcement\": \"baumgarte\" beside them");
  }
  lists.gains.emplace();
  const auto a = node.Required("alpha", "a gain [1/s] beside \"beta\"");
  const auto b = node.Required("beta", "a gain [1/s] beside \"alpha\"");
  if (a) lists.gains->alpha = a->Number(kNotNegative);
  if (b) lists.gains->beta = b->Number(kNotNegative);
}

const Fields<MethodLists>& MethodFields() {
  static const Fields<MethodLists> fields(
      "method", "Method that imposes the loop constraints. Lists expand as a cross product.",
      {{"formulation", Choices(&MethodLists::formulations, FormulationNames, "a formulation"),
        "Algorithm that imposes the constraints.", "a formulation"},
       {"enforcement", Choices(&MethodLists::enforcements, LevelNames, "a level of enforcement"),
        "Level at which constraints are enforced.", "a level of enforcement"},
       {"coordinates", Choices(&MethodLists::coordinates, NamesOf<Coordinates>, "a coordinate set"),
        "Coordinates of the joints of a tree, or of every body."},
       {"solver", Choices(&MethodLists::solvers, NamesOf<SolverKind>, "a solver"),
        "Solver of the formulation. In reduction, plain uses the fixed independent set, "
        "rank-revealing the automatic partition."},
       {"threads", IntegerList(&MethodLists::threads, 1, kMaxThreads),
        "Threads for one right-hand side. Results are bitwise equal for any number."},
       {"execution", Choices(&MethodLists::executions, NamesOf<Execution>, "an execution"),
        "Right-hand sides by the library, with or without fast paths (general), or by C code "
        "generated from it, without or with fused multiply-add (docs/operation-counts.md)."},
       {"alpha", NumberSchema(kNotNegative),
        "Gain on velocity violations [1/s]; baumgarte only, together with beta."},
       {"beta", NumberSchema(kNotNegative),
        "Gain on position violations [1/s]; baumgarte only, together with alpha."},
       {"", By({{"dependencies", {{"alpha", {"beta"}}, {"beta", {"alpha"}}}}}, ReadGains)},
       {"", By(Json::object(), RequireLevels)},
       {"", By(Json::object(), RequirePeersOwn)}});
  return fields;
}

/// Returns the cross product of an entry's lists, first key slowest.
std::vector<Method> ReadMethodEntry(const JsonNode& node) {
  std::vector<Method> methods;
  MethodLists lists;
  if (!MethodFields().Read(node, &lists)) return methods;
  for (const std::string& formulation : lists.formulations) {
    for (const Enforcement enforcement : lists.enforcements) {
      for (const Coordinates set : lists.coordinates) {
        for (const SolverKind solver : lists.solvers) {
          for (const std::int64_t threads : lists.threads) {
            for (const Execution execution : lists.executions) {
              methods.push_back({formulation, enforcement, set, solver, lists.gains,
                                 static_cast<int>(threads), execution});
            }
          }
        }
      }
    }
  }
  return methods;
}

}  // namespace

Json SweepSchema() {
  const Json axis = AxisFields().Schema();
  Json zip = ObjectSchema("", {{"zip", ArraySchema(axis, 2), "Axes that advance together.", true}});
  zip["words"] = "`{\"zip\": [axis, ...]}`";
  return ArraySchema(EitherSchema({axis, zip}), 0, kMaxAxes);
}

Sweep::Sweep(const JsonNode& root, ExperimentDocument& document,
             const std::vector<std::string>& settings) {
  const auto node = root.Optional("sweep");
  if (!node) return;
  ReadSweep(*node, document, settings, this);
  is_sound = is_sound && node->errors().empty();
}

std::vector<std::size_t> Sweep::Indices(std::size_t combination) const {
  std::vector<std::size_t> indices(groups.size());
  for (std::size_t i = groups.size(); i-- > 0;) {
    indices[i] = combination % groups[i].count();
    combination /= groups[i].count();
  }
  return indices;
}

void Sweep::Apply(std::size_t combination, ExperimentDocument& document) const {
  const std::vector<std::size_t> indices = Indices(combination);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    for (const SweepAxis& axis : groups[i].axes) {
      for (const std::string& pointer : axis.fields.pointers) {
        document.Set(pointer, axis.values[indices[i]]);
      }
    }
  }
}

Record Sweep::Parameters(std::size_t combination) const {
  Record parameters;
  const std::vector<std::size_t> indices = Indices(combination);
  for (std::size_t i = 0; i < groups.size(); ++i) {
    for (const SweepAxis& axis : groups[i].axes) {
      parameters.Set(axis.name, axis.parameters[indices[i]]);
    }
  }
  return parameters;
}

void Sweep::Note(Origins* origins) const {
  // two axes may have created one object: notes of fields follow notes of their parents
  for (const bool whole : {true, false}) {
    for (const SweepGroup& group : groups) {
      for (const SweepAxis& axis : group.axes) {
        for (const std::string& pointer : whole ? axis.fields.made : axis.fields.pointers) {
          origins->Note(pointer, fmt::format("a value of axis \"{}\"", axis.name), axis.source);
        }
      }
    }
  }
}

Json MethodsSchema() { return Named("methods", OneOrMoreSchema(MethodFields().Schema())); }

std::vector<Method> ReadMethods(const JsonNode& node) {
  std::vector<Method> methods;
  for (const JsonNode& element : node.OneOrMore("methods")) {
    for (const Method& method : ReadMethodEntry(element)) {
      const bool again = std::find(methods.begin(), methods.end(), method) != methods.end();
      if (again) {
        element.FailAs(ToString(method) + " again", "each method once");
      } else {
        methods.push_back(method);
      }
    }
  }
  return methods;
}

// "exclude" of an experiment file.

Json ExclusionsSchema() {
  const Json scalar = {{"type", {"string", "number", "boolean"}}, {"words", "a value"}};
  const Json condition = OneOrMoreSchema(scalar, false, SpacedSchema(NumberSchema(), false));
  return ArraySchema(MapSchema(Named("condition", condition), 1), 0, kMaxRules);
}

std::vector<Selection> ReadExclusions(const JsonNode& root, const Record& keys) {
  std::vector<Selection> exclusions;
  const auto node = root.Optional("exclude");
  if (!node) return exclusions;
  const std::vector<JsonNode> elements = node->Elements("rules");
  if (elements.size() > kMaxRules) {
    node->Fail(fmt::format("at most {} rules", kMaxRules));
    return exclusions;
  }
  NameList known;
  for (const auto& [name, value] : keys.items()) {
    if (name != "kind" && name != "experiment") known.Add(name);
  }
  known.Add("step");  // only for cases with fixed steps
  for (const JsonNode& element : elements) {
    Selection& rule = exclusions.emplace_back();
    if (!element.ExpectObject(known)) continue;
    if (element.value().empty()) element.Fail("at least one condition");
    for (const auto& [key, values] : element.Members()) {
      Condition& condition = rule.emplace_back();
      condition.key = key;
      if (values.value().is_object()) {
        for (const double number : values.Spaced()) {
          condition.values.push_back(fmt::format("{}", number));
        }
        continue;
      }
      for (const JsonNode& value : values.OneOrMore("values")) {
        const Json& one = value.value();
        if (one.is_structured() || one.is_null()) {
          value.Fail("a string, a number, true or false");
        } else {
          condition.values.push_back(one.is_string()   ? one.get<std::string>()
                                     : one.is_number() ? fmt::format("{}", one.get<double>())
                                                       : one.dump());
        }
      }
    }
  }
  return exclusions;
}

}  // namespace loopbench::harness
