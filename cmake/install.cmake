# cmake --install build/PRESET --prefix P:
#
#   bin/loopbench
#   include/loopbench/     headers under the names that they have here: "mechanism/model/mechanism.h"
#   lib/                   static libraries
#   lib/cmake/loopbench/   the package: find_package(loopbench) gives the target loopbench::loopbench
#   share/loopbench/       schema/ and mechanisms/
#   lib/python3/dist-packages/loopbench.py
#   share/man/man1/        loopbench.1
#   share/bash-completion/completions/, share/zsh/site-functions/, share/fish/vendor_completions.d/
if(LOOPBENCH_SANITIZE)
  return()
endif()
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
# What runs is one Debian package, what others build with another (cmake/package.cmake).
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)

target_include_directories(loopbench_mechanism INTERFACE
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/loopbench>)
# Eigen's types look the same in memory for every -march only without Eigen's vector code.
target_compile_definitions(loopbench_mechanism INTERFACE $<INSTALL_INTERFACE:EIGEN_DONT_VECTORIZE>)
target_compile_features(loopbench_mechanism INTERFACE cxx_std_20)

set(installed loopbench_mechanism ${LOOPBENCH_FORMULATION_LIBRARIES} loopbench_generate loopbench_harness)
foreach(optional loopbench_precision loopbench_contract)
  if(TARGET ${optional})
    list(APPEND installed ${optional})
  endif()
endforeach()
foreach(library ${installed})
  string(REPLACE "loopbench_" "" name ${library})
  set_target_properties(${library} PROPERTIES EXPORT_NAME ${name})
endforeach()
set_target_properties(loopbench_harness PROPERTIES EXPORT_NAME loopbench)
install(TARGETS ${installed} EXPORT loopbench)
install(TARGETS loopbench RUNTIME COMPONENT runtime)
if(TARGET loopbench_count)
  install(TARGETS loopbench_count RUNTIME COMPONENT runtime)  # for loopbench baseline --counts
endif()

# The program itself knows its options: it writes its manual pages and completions.
set(shell_files ${CMAKE_BINARY_DIR}/shell)
file(MAKE_DIRECTORY ${shell_files})
file(MAKE_DIRECTORY ${shell_files}/man1)
add_custom_command(OUTPUT ${shell_files}/man1/loopbench.1 ${shell_files}/loopbench ${shell_files}/_loopbench ${shell_files}/loopbench.fish
  COMMAND loopbench manual --out ${shell_files}/man1
  COMMAND loopbench completion bash > ${shell_files}/loopbench
  COMMAND loopbench completion zsh > ${shell_files}/_loopbench
  COMMAND loopbench completion fish > ${shell_files}/loopbench.fish
  DEPENDS loopbench VERBATIM)
add_custom_target(loopbench_shell ALL DEPENDS ${shell_files}/man1/loopbench.1)
install(DIRECTORY ${shell_files}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT runtime)
install(FILES ${shell_files}/loopbench DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT runtime)
install(FILES ${shell_files}/_loopbench DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions COMPONENT runtime)
install(FILES ${shell_files}/loopbench.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT runtime)

# Headers that need what is private here (JSON, SUNDIALS, CLI11) stay here.
install(DIRECTORY mechanism ${LOOPBENCH_FORMULATIONS} harness
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/loopbench FILES_MATCHING PATTERN "*.h"
  REGEX "/(base/(json_|fields|numeric_option)|config/.*_sections\\.h|\
[a-z]+/[a-z]+_schemas|cli/command_line|exchange/(xml_|import_))" EXCLUDE)
if(TARGET loopbench_contract)
  install(FILES tests/contract/check.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/loopbench/tests/contract)
endif()
if(LOOPBENCH_REPORT)
  install(FILES ${CMAKE_BINARY_DIR}/web/node_modules/uplot/LICENSE
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/loopbench RENAME LICENSE.uPlot COMPONENT runtime)
endif()
install(FILES python/loopbench.py DESTINATION lib/python3/dist-packages COMPONENT runtime)
install(DIRECTORY configs/schema configs/mechanisms DESTINATION ${CMAKE_INSTALL_DATADIR}/loopbench COMPONENT runtime)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright COMPONENT runtime)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/loopbench-dev RENAME copyright)

# What makes code of others comparable in time and bits: optimisation, assertions and -march as here.
string(TOUPPER "${CMAKE_BUILD_TYPE}" build_type)
separate_arguments(same_flags UNIX_COMMAND "${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${build_type}}")
if(NOT "-DNDEBUG" IN_LIST same_flags)
  list(APPEND same_flags -UNDEBUG)
endif()
list(APPEND same_flags -march=${LOOPBENCH_MARCH} -ffp-contract=off -DEIGEN_DONT_PARALLELIZE
  -DEIGEN_STACK_ALLOCATION_LIMIT=1048576)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/loopbench)
install(EXPORT loopbench NAMESPACE loopbench:: FILE loopbench-targets.cmake DESTINATION ${package})
configure_package_config_file(cmake/loopbench-config.cmake.in ${CMAKE_BINARY_DIR}/loopbench-config.cmake
  INSTALL_DESTINATION ${package})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/loopbench-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/loopbench-config.cmake ${CMAKE_BINARY_DIR}/loopbench-config-version.cmake
  DESTINATION ${package})
