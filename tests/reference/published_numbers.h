// Published and derived numbers of benchmark problems, SI units.
//
// Source: data files of the A Coruna MBS benchmark (IFToMM A01, A02; lim.ii.udc.es/mbsbenchmark),
// as kept in github.com/Jiaqi-knight/simEngine3D and mikevignos/simEngine3D-Vignos. "Published" is
// the file as printed, "derived" an independent integration at 1e-12 and better, given with all
// digits.
#pragma once

#include "tests/standard.h"

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

/// The end of the same file.
inline constexpr std::array<PathPoint, 2> kA01PublishedLate = {
    {{1999.5, 0.995044, -0.0994392}, {2000.0, 0.814603, -0.580019}}};

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

/// The same at 20 s, and of N = 2 at 10 s: derived, and the limit of the series of step sizes that
/// github.com/jgerstmayr/EXUDYN (TestModels, N-four-bar) gives for x.
inline constexpr PathPoint kA02PublishedN40At20Seconds = {20.0, 0.410902, 0.911679};
inline constexpr PathPoint kA02DerivedN2AtTenSeconds = {10.0, 0.32845811153977883,
                                                        0.9445185381789615};
inline constexpr double kA02ExudynLimitX = 0.3284581;

/// A03_andrews: angles beta, theta, gamma, phi, delta, omega, epsilon [rad] and their rates [rad/s]
/// at 0.03 s. Source: Test Set for IVP Solvers (CWI and University of Bari), problem "andrews", as
/// kept in github.com/cran/deTestSet (src/Ex_andrews.f); computed there by PSIDE with rtol = atol =
/// 1e-14. "Verified": two independent integrations that agree to 1e-12 rad; the published angles
/// are within 1.5e-9 rad of them, the speeds within 5.1e-8 of their size.
struct A03State {
  std::array<double, 7> q, v;
};
inline constexpr A03State kA03Published = {
    {15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948,
     0.5244099658805303, 0.5347301163226948, 1.048080741042263},
    {1139.920302151208, -1424.379294994111, 11.03291221937134, 19.29337464421385,
     0.5735699284790808, -19.29337464421385, 0.3231791658026955}};
inline constexpr A03State kA03Verified = {
    {15.8107711951537, -15.7563710584118, 0.0408222401196458, -0.53473011634208, 0.524409965879954,
     0.53473011634208, 1.04808074104194},
    {1139.92030225911, -1424.37929517754, 11.0329119106186, 19.293374105032, 0.5735699148295,
     -19.293374105032, 0.32317914924913}};

/// A05_flyball, derived: height of the slider [m], angle of the rods below the horizontal [rad] and
/// speed of the shaft [rad/s]; two stiff integrators on a reduction to three coordinates agree to
/// 2e-11. Parameters: A Coruna MBS benchmark A05, as in
/// github.com/RehabEngGroup/MBSbenchmarksInOpenSim; its plotted ADAMS curve stays within [0.500,
/// 0.743] m and ends near 0.62 m.
struct A05State {
  double t, s, alpha, omega;
};
inline constexpr std::array<A05State, 5> kA05Derived = {
    {{0.5, 0.7432494247876106, 0.2594913815420577, 5.103415421970221},
     {1.0, 0.5014209223784615, 0.5218333016268191, 6.271125741893527},
     {2.0, 0.5059092942943622, 0.516663797367313, 6.236223614468247},
     {5.0, 0.5355631037155776, 0.4828745765938844, 6.022496499824989},
     {10.0, 0.6196229170581472, 0.390073701848123, 5.548203622712205}}};

/// Slider-crank of SUNDIALS: crank angle q [rad], position x of the rod's centre of mass [m], rod
/// angle p [rad]. Source: github.com/LLNL/sundials, examples/ida/serial/idaSlCrank_dns.out (rtol =
/// atol = 1e-6, five digits). "Verified": one coordinate, 1e-13.
struct SliderCrankState {
  double t, q, x, p;
};
inline constexpr std::array<SliderCrankState, 8> kSliderCrankPublished = {
    {{0.25, 1.5548, 0.87406, -0.52352},
     {0.5, 1.5069, 0.89855, -0.52242},
     {1.0, 1.3154, 1.0015, -0.50497},
     {2.0, 0.57904, 1.3803, -0.27715},
     {4.0, -1.2064, 1.0623, 0.48609},
     {6.0, -1.108, 1.1176, 0.46386},
     {8.0, 0.64422, 1.3536, -0.305},
     {10.0, 1.2757, 1.0236, -0.49881}}};
inline constexpr std::array<SliderCrankState, 8> kSliderCrankVerified = {
    {{0.25, 1.5548000857457858, 0.8740601123405581, -0.52352491263339},
     {0.5, 1.5068752591878247, 0.8985529238057799, -0.5224200793788714},
     {1.0, 1.3154205708817028, 1.0014918072307977, -0.5049734706420022},
     {2.0, 0.5790388120488444, 1.3803352719611748, -0.2771440957389975},
     {4.0, -1.2064316477031662, 1.0623426557500424, 0.4860931634210145},
     {6.0, -1.1079974930772516, 1.1175594838688039, 0.46385963393149005},
     {8.0, 0.6442255394813812, 1.3536306145268862, -0.3049963498574606},
     {10.0, 1.2756758486502966, 1.0235785589798074, -0.4988130491825083}}};
/// Speed of the crank at 10 s [rad/s]; integral of the kinetic energy over 10 s [J s], published in
/// examples/idas/serial/idasSlCrank_dns.out (rtol 1e-6, atol 1e-7).
inline constexpr double kSliderCrankSpeedVerified = -0.23991499719592468;
inline constexpr double kSliderCrankIntegralVerified = 3.3366067994828676;
inline constexpr double kSliderCrankIntegralPublished = 3.3366160662909388;

/// Errors of the Cartesian pendulum at 30 s [m], [m/s], and of its constraint x^2 + y^2 = 1.
/// Published: github.com/LLNL/sundials, examples/cvode/serial/cvPendulum_dns.out, CVODE's BDF, with
/// and without projection of the state.
struct PendulumErrors {
  double rtol = 0.0;
  bool projected = false;
  double x = 0.0, y = 0.0, vx = 0.0, vy = 0.0, constraint = 0.0;
};
inline constexpr std::array<PendulumErrors, 7> kPendulumDriftPublished = {
    {{1e-05, false, 0.561, 0.898, 4.26, 2.1, 0.000619},
     {1e-06, false, 0.00168, 0.0574, 0.0577, 1.0, 7.05e-05},
     {1e-07, false, 0.000258, 0.0345, 0.0161, 1.11, 0.000677},
     {1e-08, false, 9.55e-06, 0.00852, 0.000338, 0.195, 5.35e-05},
     {1e-09, false, 1.39e-06, 0.0017, 0.000112, 0.039, 5.67e-06},
     {1e-05, true, 2.53e-06, 0.00225, 0.00018, 0.0801, 0.0},
     {1e-09, true, 1.6e-12, 1.79e-06, 1.39e-10, 7.79e-05, 1.11e-16}}};

/// One unit in the fifth digit of a printed number.
inline double FifthDigit(double printed) {
  return std::pow(10.0, std::floor(std::log10(std::abs(printed))) - 4);
}

}  // namespace loopbench::harness::reference
