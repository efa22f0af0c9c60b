// Published and derived numbers of benchmark problems, SI units.
//
// Source: data files of the A Coruna MBS benchmark (IFToMM A01, A02; lim.ii.udc.es/mbsbenchmark),
// as kept in github.com/Jiaqi-knight/simEngine3D and mikevignos/simEngine3D-Vignos. "Published" is
// the file as printed, "derived" an independent integration at 1e-12 and better, given with all
// digits.
#pragma once

#include <array>

namespace loopbench::harness::reference {

/// A point of a path.
struct PathPoint {
  double t, x, y;
};

/// A01_pendulum, published_samples: point mass on a massless rod of 1 m, released from (-1, 0).
inline constexpr std::array<PathPoint, 4> kA01Published = {{{0.5, -0.391049, -0.92037},
                                                            {1.0, 0.986292, -0.165011},
                                                            {1.5, 0.884132, -0.467237},
                                                            {10.0, -0.275087, -0.961419}}};

/// The same, derived.
inline constexpr std::array<PathPoint, 4> kA01Derived = {
    {{0.5, -0.3910487915505463, -0.9203699487851922},
     {1.0, 0.9862917511318753, -0.16501085312554123},
     {1.5, 0.8841323602843032, -0.46723652414821637},
     {10.0, -0.2750874625761171, -0.961419205099125}}};

/// A02_n_four_bar, published_samples_N40: tip of the first crank (its x, y).
inline constexpr std::array<PathPoint, 4> kA02PublishedN40 = {{{0.05, 0.0502096, 0.998739},
                                                               {0.1, 0.101676, 0.994818},
                                                               {0.15, 0.155656, 0.987811},
                                                               {0.2, 0.213388, 0.976967}}};

/// A02_n_four_bar, derived: crank angle from the vertical at 0.5 s [rad] for N windows.
struct A02Angle {
  int windows;
  double phi;
};
inline constexpr std::array<A02Angle, 3> kA02DerivedAtHalfSecond = {
    {{1, 0.7775178758353721}, {2, 0.7688186275552173}, {40, 0.7586275160827806}}};

}  // namespace loopbench::harness::reference
