#include "harness/base/file_kind.h"

#include <array>

#include "harness/base/fields.h"
#include "harness/base/text.h"

namespace loopbench::harness {
namespace {

/// Returns true for keys that every file may have.
bool IsCommon(std::string_view key) { return key == "$schema" || key == "format"; }

/// Kind of file, with its top-level keys.
struct Kind {
  FileKind kind;
  std::string_view name;
  std::vector<std::string> own;  ///< characteristic keys; a file of this kind has at least one
  NameList keys;                 ///< all keys, common keys last

  std::ptrdiff_t CountKnown(const Json& document) const {
    std::ptrdiff_t known = 0;
    for (const auto& [key, value] : document.items()) {
      if (!IsCommon(key) && keys.Find(key)) ++known;
    }
    return known;
  }
};

const std::array<Kind, 6>& Kinds() {
  static const std::array<Kind, 6> kinds = {{
      {FileKind::kMechanism,
       "a mechanism",
       {"bodies", "joints"},
       {"name", "comment", "space", "gravity", "bodies", "ground", "joints", "couplings", "forces",
        "initial", "independent", "accuracy", "known_solution", "expect", "$schema", "format"}},
      {FileKind::kExperiment,
       "an experiment",
       {"problems", "methods"},
       {"name",   "comment",     "problems", "methods",    "tolerances", "fixed_steps",
        "atol",   "integration", "refine",   "integrator", "jacobian",   "ensembles",
        "limits", "preprocess",  "series",   "timing",     "precision",  "reference",
        "output", "sweep",       "exclude",  "$schema",    "format"}},
      {FileKind::kClaims, "claims", {"claims"}, {"claims", "$schema", "format"}},
      {FileKind::kMap,
       "a robustness map",
       {"methods", "groups"},
       {"title", "comment", "methods", "groups", "$schema", "format"}},
      {FileKind::kBenchmarks,
       "benchmarks",
       {"groups"},
       {"name", "comment", "states", "integrator", "step", "groups", "$schema", "format"}},
      {FileKind::kSeries,
       "a published series",
       {"times", "quantities"},
       {"name", "comment", "source", "times", "quantities", "$schema", "format"}},
  }};
  return kinds;
}

/// Returns the kinds that have most of an object's keys.
std::vector<const Kind*> Likeliest(const Json& document) {
  std::vector<const Kind*> best;
  std::ptrdiff_t most = 0;
  for (const Kind& kind : Kinds()) {
    const std::ptrdiff_t known = kind.CountKnown(document);
    if (known > most) best.clear();
    most = std::max(most, known);
    if (known == most) best.push_back(&kind);
  }
  return best;
}

/// "a mechanism ("bodies", "joints")", of the keys that satisfy `has`.
template <class Has>
std::string WithKeys(const Kind& kind, const std::vector<std::string>& keys, Has has) {
  std::vector<std::string> quoted;
  for (const std::string& key : keys) {
    if (has(key)) quoted.push_back('"' + key + '"');
  }
  return fmt::format("{} ({})", kind.name, fmt::join(quoted, ", "));
}

/// Reports that the kind of a file is ambiguous. `kinds`: the possible kinds.
void ReportAmbiguous(const JsonNode& root, const std::vector<const Kind*>& kinds) {
  std::vector<std::string> found, expected;
  for (const Kind* kind : kinds) {
    found.push_back(WithKeys(*kind, kind->keys.all(), [&](const std::string& key) {
      return !IsCommon(key) && root.value().contains(key);
    }));
  }
  for (const Kind& kind : Kinds()) {
    const bool possible = kinds.empty() || std::ranges::find(kinds, &kind) != kinds.end();
    if (possible) expected.push_back(WithKeys(kind, kind.own, [](const auto&) { return true; }));
  }
  root.FailAs(kinds.empty() ? "no key that identifies the file type"
                            : fmt::format("keys of {}", ListInWords(found)),
              fmt::format("those of one kind: {}", ListInWords(expected, "or")));
}

}  // namespace

bool ExpectDocument(const JsonNode& root, FileKind kind) {
  const Kind& wanted = *std::ranges::find(Kinds(), kind, &Kind::kind);
  if (root.value().is_object()) {
    const Kind& likeliest = *Likeliest(root.value()).front();
    const auto own = std::ranges::find_if(likeliest.own, [&](const std::string& key) {
      return root.value().contains(key) && !wanted.keys.Find(key);
    });
    const bool of_another = likeliest.CountKnown(root.value()) > wanted.CountKnown(root.value());
    if (of_another && own != likeliest.own.end()) {
      root.FailAs(fmt::format("{} (it has \"{}\")", likeliest.name, *own), wanted.name);
      return false;
    }
  }
  // first: keys of a later format are not spelling errors
  if (const auto format = root.Optional("format"); format && format->value() != kFileFormat) {
    format->Fail(fmt::format(kExpectedFormat, kFileFormat));
    return false;
  }
  if (!root.ExpectObject(wanted.keys)) return false;
  if (const auto schema = root.Optional("$schema")) schema->Text();
  return true;
}

FileKind KindOfFile(const std::filesystem::path& path) {
  const std::string text = ReadTextFile(path);
  const Json document = ParseDocument(text, path.string());
  ErrorList errors(path.string(), text);
  const JsonNode root(document, "", errors);
  if (!document.is_object()) {
    root.Fail(
        "an object: a mechanism, an experiment, claims, a robustness map, benchmarks or a "
        "published "
        "series");
  }
  errors.ThrowIfAny();
  std::vector<const Kind*> likeliest = Likeliest(document);
  const auto has = [&document](const std::string& key) { return document.contains(key); };
  std::erase_if(likeliest, [&](const Kind* kind) { return std::ranges::none_of(kind->own, has); });
  const auto is_whole = [&](const Kind* kind) { return std::ranges::all_of(kind->own, has); };
  if (likeliest.size() > 1 && std::ranges::count_if(likeliest, is_whole) == 1) {
    likeliest = {*std::ranges::find_if(likeliest, is_whole)};
  }
  if (likeliest.size() != 1) ReportAmbiguous(root, likeliest);
  errors.ThrowIfAny();
  return likeliest.front()->kind;
}

}  // namespace loopbench::harness
