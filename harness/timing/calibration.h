// Calibration workload: measures the current speed of the machine by constant work.
//
// On a virtual machine another VM may share the physical core, for milliseconds or minutes, and a
// processor may lower its clock. Program times then grow by a third without any sign of the cause.
// The calibration reveals it: one compiler generates the same instructions at the same offsets of
// cache lines in every build.
#pragma once

namespace loopbench::harness {

/// Time [ns] of factoring a small matrix and of going through the first cache several times: the
/// work whose time shows a neighbour best (loops that stay in registers show 2 %). The least of
/// three, which take some 20 us together.
double CalibrationNs();

/// Returns the smallest result of CalibrationNs() in this process and before its fork: an estimate
/// for an otherwise idle machine. Infinite before the first call.
double CalibrationBaselineNs();

}  // namespace loopbench::harness
