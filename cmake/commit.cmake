# Writes OUTPUT, a header with the commit of the sources in SOURCE; run at every build, so that an incremental
# build does not carry the commit of its last configuration. The commit is the last one that changed more than
# documents and results (a run that renews results/ does not make the program another one); "-dirty" marks
# changes since.
set(code -- . :!results :!docs :!*.md)
execute_process(COMMAND git log -1 --format=%h --abbrev=12 ${code}
  WORKING_DIRECTORY ${SOURCE} OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
execute_process(COMMAND git diff --quiet HEAD ${code}
  WORKING_DIRECTORY ${SOURCE} RESULT_VARIABLE changed ERROR_QUIET)
if(NOT commit)
  set(commit "unknown")
elseif(changed)
  string(APPEND commit "-dirty")
endif()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT [[
// The commit of this build, renewed at every build.
#pragma once

namespace loopbench::harness {

inline constexpr const char* kBuildCommit = "@commit@";

}  // namespace loopbench::harness
]])
