#include "harness/cli/program_convert.h"

#include "harness/cli/options.h"
#include "harness/text/numeric_option.h"

namespace loopbench::harness {

namespace {

constexpr const char* kConvertFooter = R"(
The file has the mechanism at its assembled start, with the user's names; what is said in other words, and what is
lost, stands in its first comment and is printed. What a format does not have is named, with exit code 2, and nothing
is written: prescribed motions, forces that depend on time, drag, forces along a joint that closes a loop; docs/exchange-out.md.

  loopbench convert my.json --to mjcf                  # my.xml: python3 -m mujoco.viewer --mjcf=my.xml
  loopbench convert my.json --to mjcf --step 1e-4      # stiff springs, and loops that come apart less
  loopbench convert my.json --to simbody --out my.cpp
  g++ -std=c++17 -O2 -isystem /usr/include/simbody my.cpp -o my -lSimTKsimbody -lSimTKmath -lSimTKcommon
  ./my                                                 # JSON: coordinates, speeds, accelerations, places
  ./my 1 1e-10                                         # the same after 1 s)";

}  // namespace

ConvertOptions::ConvertOptions(CLI::App& app) {
  app_ = app.add_subcommand("convert", "Write a mechanism for MuJoCo or Simbody");
  app_->add_option("mechanism", convert_.mechanism, "Mechanism file (JSON)")->required();
  app_->add_option("--to", convert_.to,
                   "mjcf: a model that MuJoCo loads; simbody: a C++17 program that builds a System")
      ->required()
      ->check(CLI::IsMember(ExportFormatNames()));
  app_->add_option("-o,--out", convert_.out,
                   "File (default: the mechanism file's name with .xml or .cpp, here)");
  app_->add_option("--step", convert_.options.time_step,
                   "mjcf: MuJoCo's step [s], of which its closures are as stiff as they may be")
      ->check(NumberFrom(1e-12, 1e3))
      ->capture_default_str();
  AddJson(app_, &convert_.json);
  AddLimits(app_, &convert_.limits);
  app_->footer(kConvertFooter);
}

std::optional<int> ConvertOptions::Run() const {
  if (!*app_) return std::nullopt;
  return Convert(convert_);
}

}  // namespace loopbench::harness
