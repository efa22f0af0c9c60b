#include "harness/exchange/import.h"

#include <fmt/format.h>

#include <algorithm>

#include "harness/exchange/import_draft.h"
#include "harness/text/config_error.h"

namespace loopbench::harness {

namespace {

/// The root element of each format, in their order.
const std::vector<std::string>& Roots() {
  static const std::vector<std::string> roots = {"mujoco", "robot", "sdf"};
  return roots;
}

}  // namespace

const std::vector<std::string>& ImportFormats() {
  static const std::vector<std::string> formats = {"mjcf", "urdf", "sdf"};
  return formats;
}

Imported ImportText(std::string_view text, const std::string& file, const ImportOptions& options) {
  const XmlFile xml(text, file);
  const XmlElement root = xml.root();
  const auto found = std::ranges::find(Roots(), root.tag());
  const auto wanted = std::ranges::find(ImportFormats(), options.format);
  if (found == Roots().end()) {
    root.Fail("this root element", "<mujoco> (MJCF), <robot> (URDF) or <sdf>");
  }
  const auto index = found - Roots().begin();
  const std::string& format = ImportFormats()[static_cast<std::size_t>(index)];
  if (wanted != ImportFormats().end() && *wanted != format) {
    root.Fail(format, fmt::format("{}, as --format says", *wanted));
  }
  if (options.floats && format != "urdf") {
    root.Fail(format, "urdf with --floating: other formats say what is free");
  }
  ImportDraft draft(xml, options);
  draft.description.name = std::filesystem::path(file).stem().string();
  if (format == "mjcf") ReadMjcf(root, &draft);
  if (format == "urdf") ReadUrdf(root, options, &draft);
  if (format == "sdf") ReadSdf(root, &draft);
  if (draft.description.name.empty()) draft.description.name = "imported";
  return draft.Finish(format);
}

Imported ImportMechanism(const std::filesystem::path& path, const ImportOptions& options) {
  return ImportText(ReadTextFile(path), path.string(), options);
}

}  // namespace loopbench::harness
