// How fast the machine is at the moment, by the time of work that is always the same.
//
// On a virtual machine somebody else's thread may work on the other half of the core, for
// milliseconds or for minutes, and a processor may lower its clock. Times of a program are then a
// third longer and nothing in them tells why. The yardstick does: one compiler
// makes the same instructions of it in every build, at the same places of cache lines.
#pragma once

namespace loopbench::harness {

/// Time [ns] of factoring a small matrix and of going through the first cache several times: the
/// work whose time shows a neighbour best (loops that stay in registers show 2 %). The least of
/// three, which take some 20 us together.
double YardstickNs();

/// The least that YardstickNs() found in this process and before it was forked: how fast the
/// machine is for whoever has it alone, as far as is known. Infinite before the first.
double YardstickAloneNs();

}  // namespace loopbench::harness
