#include "harness/exchange/export_mechanism.h"

#include <utility>

#include "harness/exchange/export_mjcf.h"
#include "harness/exchange/export_names.h"
#include "harness/exchange/export_simbody.h"
#include "harness/exchange/model_of_mechanism.h"
#include "mechanism/simplify/compile.h"

namespace loopbench::exchange {
namespace {

/// MuJoCo regularises redundant constraints, and gets all of them.
ExportedFile WriteMjcf(const MechanismDescription& description, const ExportOptions& options) {
  const Mjcf made =
      MakeMjcf(MakeModelAtStart(description), {.time_step = options.time_step, .shapes = true});
  return {"<!--\n" +
              CommentLines("  ", "\"" + description.name +
                                     "\", a mechanism of Loopbench at its assembled start, for "
                                     "MuJoCo. SI units, angles in rad. The keyframe \"start\" has "
                                     "its speeds.") +
              CommentOfNotes("  ", made.notes) + "-->\n" + made.document,
          made.notes};
}

/// Simbody finds the rank of constraints at each position anew, and loses it in some of many; so it
/// gets those that are left when the redundant ones are released.
ExportedFile WriteSimbody(const MechanismDescription& description, const ExportOptions&) {
  CompileOptions options = CompileOptions::None();
  options.redundancy = true;
  const Compiled compiled = Compile(description, options);
  SimbodyProgramText made =
      WriteSimbodyProgram(MakeModelAtStart(compiled.parts.front().description));
  return {std::move(made.program), std::move(made.notes)};
}

}  // namespace

const std::vector<ExportFormat>& ExportFormats() {
  static const std::vector<ExportFormat> kFormats = {
      {"mjcf", ".xml", "MJCF, which MuJoCo loads", WriteMjcf},
      {"simbody", ".cpp", "a C++17 program that builds the mechanism in Simbody", WriteSimbody}};
  return kFormats;
}

ExportedFile Export(const MechanismDescription& description, const ExportFormat& format,
                    const ExportOptions& options) {
  return format.write(description, options);
}

}  // namespace loopbench::exchange
