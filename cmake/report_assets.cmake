# Fetches what pages of `loopbench report` are drawn with into the build tree, and writes it with web/report/ as
# a source file. Called by the build: cmake -DNPM=... -DWEB=.../web -DWORK=... -DOUTPUT=... -P report_assets.cmake
set(modules parts table plots motion costs map page)
set(script "")
set(style "")
if(NPM)
  foreach(file package.json package-lock.json)
    configure_file(${WEB}/${file} ${WORK}/${file} COPYONLY)
  endforeach()
  execute_process(COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --prefer-offline
    WORKING_DIRECTORY ${WORK} RESULT_VARIABLE failed OUTPUT_VARIABLE said ERROR_VARIABLE said)
  if(failed)
    message(WARNING "${said}\nnpm ci could not fetch what reports are drawn with (web/package-lock.json); it needs the network once. "
      "`loopbench report` is left out of this build: remove ${OUTPUT} and build again to have it.")
    set(NPM "")
  endif()
endif()
if(NPM)
  set(uplot ${WORK}/node_modules/uplot)
  file(READ ${uplot}/LICENSE licence)
  file(READ ${uplot}/dist/uPlot.iife.min.js text)
  set(script "/*!\nuPlot\n\n${licence}*/\n${text}\n")
  file(READ ${uplot}/dist/uPlot.min.css style)
  file(READ ${WEB}/report/report.css text)
  string(APPEND style "\n${text}")
  foreach(module ${modules})
    file(READ ${WEB}/report/${module}.js text)
    string(APPEND script "${text}")
  endforeach()
endif()
file(WRITE ${OUTPUT} "// Written by the build from web/report/ and uPlot.\n#include \"harness/figures/report.h\"\n\n"
  "namespace loopbench::harness {\n\nconst std::string_view kReportScript = R\"~~~~(${script})~~~~\";\n"
  "const std::string_view kReportStyle = R\"~~~~(${style})~~~~\";\n\n}  // namespace loopbench::harness\n")
