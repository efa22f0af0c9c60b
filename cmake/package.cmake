# cpack --config build/release/CPackConfig.cmake -B build/release/packages: loopbench_*.deb and loopbench-dev_*.deb
# (docs/release.md). Components come from cmake/install.cmake.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME loopbench)
set(CPACK_PACKAGE_VENDOR "The Loopbench authors")
set(CPACK_PACKAGE_CONTACT "The Loopbench authors <noreply@loopbench.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "comparative benchmark harness for closed-loop multibody dynamics")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL runtime development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_STRIP_FILES ON)

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME loopbench)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION science)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "gnuplot-nox, python3-pandas")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SUGGESTS "git, valgrind, loopbench-dev")
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION
  "Runs mechanisms with closed loops by three formulations under one integrator, and
writes tables and figures of constraint drift, energy, true errors and times.
Needs a processor of x86-64-v3 (AVX2 and FMA).")
# the whole program is compiled for it: say so before an illegal instruction does
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_LIST_DIR}/preinst)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME loopbench-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev, libsundials-dev, libfmt-dev, libtinyxml2-dev, libboost-context-dev")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS "g++, cmake")
set(CPACK_COMPONENT_DEVELOPMENT_DEPENDS runtime)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
  "Headers, static libraries and CMake package: for formulations, joints, forces and
observers of one's own, and for programs that integrate mechanisms.")
include(CPack)
