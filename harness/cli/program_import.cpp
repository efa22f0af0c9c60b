#include "harness/cli/program_import.h"

#include <charconv>
#include <cmath>

#include "harness/cli/options.h"
#include "harness/text/config_error.h"

namespace loopbench::harness {

namespace {

constexpr const char* kImportFooter = R"(
The format is what the root element says: <mujoco>, <robot> (URDF) or <sdf>. Every line of output is one element
that is not there or there in another way, with its line in the file and the reason. What URDF cannot say, loops,
forces and a start, stands in a sidecar (--loops) with the keys of mechanism files; docs/exchange.md has tables of
what each element becomes.

Examples:
  loopbench import arm.urdf --loops arm-loops.json --out arm.json
  loopbench import four-bar.xml --planar --out four-bar.json
  loopbench import model.sdf --json
  loopbench explain arm.json)";

/// "0,0,-1.62": three numbers.
Eigen::Vector3d ParseGravity(const std::string& text) {
  Eigen::Vector3d gravity;
  const char* at = text.data();
  const char* end = at + text.size();
  for (int i = 0; i < 3; ++i) {
    const auto [next, error] = std::from_chars(at, end, gravity[i]);
    const bool ends_well = i < 2 ? next != end && *next == ',' : next == end;
    if (error != std::errc() || !ends_well || !std::isfinite(gravity[i])) {
      throw ConfigError("--gravity " + text + ": found \"" + text +
                        "\", expected three numbers: 0,0,-9.81 [m/s^2]");
    }
    at = next + 1;
  }
  return gravity;
}

}  // namespace

ImportCommandOptions::ImportCommandOptions(CLI::App& app) {
  app_ = app.add_subcommand("import", "Read a mechanism of MuJoCo (MJCF), URDF or SDF");
  app_->footer(kImportFooter);
  ImportOptions& options = import_.options;
  app_->add_option("file", import_.file, "The description (XML)")->required();
  app_->add_option("-o,--out", import_.out,
                   "Mechanism file (default: the file's name with .json, here)");
  app_->add_option("--format", options.format, "Expected input format")
      ->check(CLI::IsMember(ImportFormats()));
  app_->add_option("--loops", options.sidecar,
                   "Sidecar (JSON): loops, joints, forces, initial, gravity, observe");
  app_->add_flag("--planar", options.planar, "As a planar mechanism, which it must be");
  app_->add_flag("--floating", options.floats, "URDF: the root link is free, not fixed");
  app_->add_flag("--keep-digits", options.keeps_digits,
                 "Keep rounded angles and directions (1.5708) as written");
  app_->add_option("--gravity", gravity_, "x,y,z in place of the file's [m/s^2]");
  app_->add_flag("--json", import_.json,
                 "One JSON document instead (docs/exchange.md has its keys)");
  AddLimits(app_, &import_.limits);
}

std::optional<int> ImportCommandOptions::Run() {
  if (!*app_) return std::nullopt;
  if (!gravity_.empty()) import_.options.gravity = ParseGravity(gravity_);
  return Import(import_);
}

}  // namespace loopbench::harness
