#include "harness/exchange/export_simbody_text.h"

#include "harness/exchange/export_names.h"

namespace loopbench::exchange {
namespace {

constexpr const char* kHead = R"(//
// Debian's libsimbody-dev has Simbody. To compile and run:
//   g++ -std=c++17 -O2 -isystem /usr/include/simbody FILE.cpp -o FILE -lSimTKsimbody -lSimTKmath -lSimTKcommon
//   ./FILE              JSON: the start with its accelerations
//   ./FILE 1            the same after 1 s
//   ./FILE 1 1e-10      by a smaller error of a step (1e-8 where it is not said)
//
)";

constexpr const char* kDeclarations = R"(#include <Simbody.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <initializer_list>
#include <vector>

namespace loopbench_export {

using namespace SimTK;

struct JointName {
  const char* name;
  int body;     // that it carries
  double sign;  // of its coordinates: the user's are so many times Simbody's
};

struct PointName {
  const char* name;
  int body;
  double at[3];
};

struct Mechanism {
  MultibodySystem system;
  SimbodyMatterSubsystem matter{system};
  GeneralForceSubsystem forces{system};
  std::vector<MobilizedBody> body;  // [0] is Ground

  Mechanism();
  void SetStart(State& state) const;
};

SimTK::Body::Rigid Rigid(double mass, double xx, double yy, double zz, double xy, double xz,
                         double yz) {
  return SimTK::Body::Rigid(MassProperties(mass, Vec3(0), Inertia(xx, yy, zz, xy, xz, yz)));
}

void Set(State& state, const MobilizedBody& body, std::initializer_list<double> q,
         std::initializer_list<double> u) {
  int i = 0;
  for (const double value : q) body.setOneQ(state, i++, value);
  i = 0;
  for (const double value : u) body.setOneU(state, i++, value);
}

)";

constexpr const char* kTail =
    R"(void PrintNumbers(const char* key, const double* values, int count) {
  std::printf(",\"%s\":[", key);
  for (int i = 0; i < count; ++i) std::printf("%s%.17g", i == 0 ? "" : ",", values[i]);
  std::printf("]");
}

void PrintJoint(const JointName& joint, const MobilizedBody& body, const State& state) {
  double q[7], u[6], udot[6];
  const int num_q = body.getNumQ(state), num_u = body.getNumU(state);
  for (int i = 0; i < num_q; ++i) q[i] = joint.sign * body.getOneQ(state, i);
  for (int i = 0; i < num_u; ++i) u[i] = joint.sign * body.getOneU(state, i);
  for (int i = 0; i < num_u; ++i) udot[i] = joint.sign * body.getOneUDot(state, i);
  std::printf("{%s", joint.name);
  PrintNumbers("q", q, num_q);
  PrintNumbers("u", u, num_u);
  PrintNumbers("udot", udot, num_u);
  std::printf("}");
}

void PrintPoint(const PointName& point, const MobilizedBody& body, const State& state,
                bool with_axes) {
  const Vec3 at = body.findStationLocationInGround(
      state, Vec3(point.at[0], point.at[1], point.at[2]));
  std::printf("{%s", point.name);
  PrintNumbers("at", &at[0], 3);
  if (with_axes) {
    double axes[9];
    const Rotation& R = body.getBodyRotation(state);
    for (int i = 0; i < 9; ++i) axes[i] = R[i / 3][i % 3];
    PrintNumbers("axes", axes, 9);
  }
  std::printf("}");
}

void Print(const Mechanism& mechanism, const State& state) {
  mechanism.system.realize(state, Stage::Acceleration);
  std::printf("{\"time\":%.17g,\n\"joints\":[", state.getTime());
  for (const JointName* one = kJoints; one->name != nullptr; ++one) {
    std::printf(one == kJoints ? "\n" : ",\n");
    PrintJoint(*one, mechanism.body[one->body], state);
  }
  std::printf("],\n\"bodies\":[");
  for (const PointName* one = kBodies; one->name != nullptr; ++one) {
    std::printf(one == kBodies ? "\n" : ",\n");
    PrintPoint(*one, mechanism.body[one->body], state, true);
  }
  std::printf("],\n\"points\":[");
  for (const PointName* one = kPoints; one->name != nullptr; ++one) {
    std::printf(one == kPoints ? "\n" : ",\n");
    PrintPoint(*one, mechanism.body[one->body], state, false);
  }
  double open = 0.0;
  for (int i = 0; i < state.getNQErr(); ++i) open = std::fmax(open, std::fabs(state.getQErr()[i]));
  std::printf("],\n\"loops_open\":%.17g}\n", open);
}

bool Read(const char* text, double* value) {
  char* end = nullptr;
  *value = std::strtod(text, &end);
  return end != text && *end == '\0' && *value > 0.0 && std::isfinite(*value);
}

int Run(int argc, char** argv) {
  double end = 0.0, accuracy = 1e-8;
  if (argc > 3 || (argc > 1 && !Read(argv[1], &end)) || (argc > 2 && !Read(argv[2], &accuracy))) {
    std::fprintf(stderr, "usage: %s [TIME > 0 [s] [ACCURACY > 0]]\n", argv[0]);
    return 2;
  }
  Mechanism mechanism;
  State state = mechanism.system.realizeTopology();
  mechanism.SetStart(state);
  if (argc > 1) {
    RungeKuttaMersonIntegrator integrator(mechanism.system);
    integrator.setAccuracy(accuracy);
    integrator.setAllowInterpolation(false);
    integrator.setFinalTime(end);
    integrator.initialize(state);
    while (integrator.getTime() < end) integrator.stepTo(end);
    state = integrator.getState();
  }
  Print(mechanism, state);
  return 0;
}

}  // namespace loopbench_export

int main(int argc, char** argv) {
  try {
    return loopbench_export::Run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
)";

}  // namespace

std::string SimbodyHead(const std::string& name, const std::vector<Note>& notes) {
  return CommentLines("// ",
                      "\"" + name +
                          "\", a mechanism of Loopbench at its assembled start, as a program "
                          "for Simbody 3.7. SI units, angles in rad.") +
         kHead + CommentOfNotes("// ", notes) + kDeclarations;
}

std::string SimbodyTail() { return kTail; }

}  // namespace loopbench::exchange
