#include "harness/cli/commands_page.h"

#include "harness/cli/commands.h"
#include "harness/judge/claims_reader.h"
#include "harness/judge/failure_map_reader.h"
#include "harness/record/provenance.h"
#include "harness/report/html.h"
#include "harness/store/contents.h"
#include "harness/store/result_store.h"
#include "harness/text/files.h"
#include "harness/text/terminal.h"

namespace loopbench::harness {

int WriteReport(const ReportCommand& command, const std::string& typed) {
  if (kReportScript.empty()) {
    PrintError("report: this program was built without (cmake -DLOOPBENCH_REPORT=ON needs npm)\n");
    return 2;
  }
  ReportOptions options{
      .store = command.store, .rules_file = command.rules, .claims_file = command.claims};
  if (!command.rules.empty()) options.rules = ReadMapRules(command.rules);
  if (!command.claims.empty()) options.claims = ReadClaims(command.claims);
  const std::vector<Record> records = LoadRecords(command.store);
  if (records.empty()) {
    PrintError("{}: no records\n", command.store.string());
    return 2;
  }
  if (options.rules) RequireOneContent(records, command.store, "map");
  if (!options.claims.empty()) RequireOneContent(records, command.store, "verdict");
  ReportData data = MakeReport(records, options);
  data.provenance = Provenance(typed);
  const std::filesystem::path out =
      command.out.empty() ? StoreFile(command.store).parent_path() / "report.html" : command.out;
  const std::string page = ToHtml(data);
  WriteFileAtomically(out, page);
  Print("wrote {}: {} runs, {} of them failed and {} doubtful, {} kB\n", out.string(), data.runs,
        data.failed, data.doubted, (page.size() + 999) / 1000);
  for (const std::string& remark : data.remarks) Print("  {}\n", remark);
  for (const std::string& file : data.changed) PrintError("{}\n", file);
  return data.changed.empty() ? 0 : 2;
}

}  // namespace loopbench::harness
