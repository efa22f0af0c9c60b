#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <utility>

#include "harness/generate/record.h"

namespace loopbench::generate {

const char* const kPrintedHelpers =
    R"(static inline double least(double a, double b) { return b < a ? b : a; }
static inline double most(double a, double b) { return a < b ? b : a; }
)";

namespace {

constexpr int kOperationsOfFunction = 500;

/// Before the text of lanes. `number` holds one number of each lane, `holds` all ones or no bits.
constexpr const char* kLaneHelpers = R"(#include <math.h>
typedef double number __attribute__((vector_size(8 * LANES)));
typedef long long holds __attribute__((vector_size(8 * LANES)));
#define EACH(f) \
  static inline number each_##f(number a) { \
    for (int i = 0; i < LANES; ++i) a[i] = f(a[i]); \
    return a; \
  }
#define EACH2(f) \
  static inline number each_##f(number a, number b) { \
    for (int i = 0; i < LANES; ++i) a[i] = f(a[i], b[i]); \
    return a; \
  }
EACH(fabs) EACH(sqrt) EACH(sin) EACH(cos) EACH(asin) EACH(acos) EACH(exp) EACH(expm1) EACH(log)
EACH(round) EACH2(atan2) EACH2(pow) EACH2(remainder)
static inline number pick(holds which, number a, number b) {
  return (number)((which & (holds)a) | (~which & (holds)b));
}
static inline number each_least(number a, number b) { return pick(b < a, b, a); }
static inline number each_most(number a, number b) { return pick(a < b, b, a); }
static void (*sines_of_lanes)(const double*, double*, double*);
void loopbench_use_lane_sines(void (*of_pose)(const double*, double*, double*)) {
  sines_of_lanes = of_pose;
}
static inline void sines(number angle, number* sine, number* cosine) {
  sines_of_lanes((const double*)&angle, (double*)sine, (double*)cosine);
}
)";

std::string Literal(double value) {
  if (std::isnan(value)) return "NAN";
  if (std::isinf(value)) return value > 0.0 ? "INFINITY" : "(-INFINITY)";
  return value < 0.0 || std::signbit(value) ? fmt::format("({:a})", value)
                                            : fmt::format("{:a}", value);
}

enum class Form { kLiterals, kConstants, kLanes };  // the last two receive constants

class Printer {
 public:
  Printer(const RecordedFunction& recorded, const std::string& name, Form form,
          bool own_sines = false)
      : form_(form),
        own_sines_(own_sines),
        has_lanes_(form == Form::kLanes),
        number_(has_lanes_ ? "number" : "double"),
        parameters_(
            fmt::format("const {0}* x, {1}{0}* y, {0}* w", number_,
                        form == Form::kLiterals ? "" : fmt::format("const {}* c, ", number_))),
        arguments_(form == Form::kLiterals ? "x, y, w" : "x, c, y, w"),
        graph_(recorded.graph),
        outputs_(recorded.outputs),
        name_(name),
        function_(graph_.nodes().size(), 0),
        places_(graph_.nodes().size(), -1),
        sines_in_(graph_.nodes().size(), -1) {
    live_ = graph_.Live(outputs_, true);
    results_.resize(graph_.nodes().size());
    tests_.resize(graph_.nodes().size());
    for (std::size_t i = 0; i < outputs_.size(); ++i) results_[outputs_[i]].push_back(i);
    for (const Comparison& comparison : graph_.comparisons()) {
      tests_[std::max(comparison.a, comparison.b)].push_back(&comparison);
    }
    if (form != Form::kLiterals) {
      const std::vector<int> given = graph_.Given(outputs_);
      for (std::size_t i = 0; i < given.size(); ++i) places_[given[i]] = static_cast<int>(i);
    }
    AssignFunctions();
    AssignRoom();
  }

  int room() const { return num_room_; }

  std::string Text() {
    int input = 0;
    for (int function = 0, node = 0; function < num_functions_; ++function) {
      Open(function);
      for (; node < std::ssize(graph_.nodes()) && function_[node] == function; ++node) {
        Print(node, function, &input);
      }
      text_ += "  return ok;\n}\n";
    }
    Put("static {0} {1}({2}) {{\n  {3}", Truth(), name_, parameters_,
        has_lanes_ ? "holds ok = " : "return ");
    for (int function = 0; function < num_functions_; ++function) {
      Put("{}{}_part{}({})",
          function == 0 ? ""
          : has_lanes_  ? ";\n  ok &= "
                        : " &&\n         ",
          name_, function, arguments_);
    }
    text_ += has_lanes_ ? ";\n  return ok;\n}\n" : ";\n}\n";
    return std::move(text_);
  }

 private:
  template <class... Arguments>
  void Put(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Arguments>(arguments)...);
  }

  /// A cosine stays with its sine.
  void AssignFunctions() {
    int operations = 0, function = 0;
    for (std::size_t node = 0; node < graph_.nodes().size(); ++node) {
      const Operation operation = graph_.nodes()[node].operation;
      if (operations >= kOperationsOfFunction && operation != Operation::kPoseCos) {
        operations = 0;
        ++function;
      }
      if (live_[node] && IsVariable(static_cast<int>(node))) ++operations;
      function_[node] = function;
    }
    num_functions_ = function + 1;
  }

  bool IsVariable(int node) const {
    const Node& of = graph_.nodes()[node];
    return of.operation > Operation::kConstant && !of.is_known;
  }

  /// A place in w for each value that another function uses.
  void AssignRoom() {
    room_.assign(graph_.nodes().size(), -1);
    const auto use = [&](int node, int by) {
      if (node < 0 || !IsVariable(node) || function_[node] == function_[by]) return;
      if (room_[node] < 0) room_[node] = num_room_++;
    };
    for (int node = 0; node < std::ssize(graph_.nodes()); ++node) {
      if (!live_[node]) continue;
      use(graph_.nodes()[node].a, node);
      use(graph_.nodes()[node].b, node);
      for (const Comparison* test : tests_[node]) use(std::min(test->a, test->b), node);
    }
  }

  void Open(int function) {
    Put("static {0} {1}_part{2}({3}) {{\n  {0} ok = {4};\n  (void)x, (void)y, (void)w;\n", Truth(),
        name_, function, parameters_, has_lanes_ ? "~(holds){0}" : "1");
  }

  const char* Truth() const { return has_lanes_ ? "holds" : "int"; }

  /// Returns the name of a node in a function.
  std::string Name(int node, int function) const {
    const Node& of = graph_.nodes()[node];
    if (of.is_known) {
      return form_ == Form::kLiterals ? Literal(of.value) : fmt::format("c[{}]", places_[node]);
    }
    if (of.operation == Operation::kInput) return fmt::format("x[{}]", places_[node]);
    if (function_[node] != function) return fmt::format("w[{}]", room_[node]);
    return fmt::format("v{}", node);
  }

  /// Sine and cosine of an angle, s and c with its node, once in each function.
  void PrintSines(int angle, int function) {
    if (std::exchange(sines_in_[angle], function) == function) return;
    Put("  {0} s{1}, c{1};\n  sines({2}, &s{1}, &c{1});\n", number_, angle, Name(angle, function));
  }

  void Print(int node, int function, int* input) {
    const Node& of = graph_.nodes()[node];
    if (of.operation == Operation::kInput) places_[node] = (*input)++;
    if (!live_[node]) return;
    const auto a = [&] { return Name(of.a, function); };
    const auto b = [&] { return Name(of.b, function); };
    const Operation operation =
        of.is_known                                     ? Operation::kConstant
        : own_sines_ && of.operation == Operation::kSin ? Operation::kPoseSin
        : own_sines_ && of.operation == Operation::kCos ? Operation::kPoseCos
                                                        : of.operation;
    const char* in_c = TraitsOf(operation).in_c;
    switch (operation) {
      case Operation::kInput:
      case Operation::kConstant:
        break;
      case Operation::kPoseSin:
      case Operation::kPoseCos:
        PrintSines(of.a, function);
        Put("  const {} v{} = {}{};\n", number_, node, in_c, of.a);
        break;
      default:
        Put("  const {} v{} = ", number_, node);
        if (std::isalpha(static_cast<unsigned char>(*in_c)) != 0) {
          Put("{}{}({}{}{})", has_lanes_ ? "each_" : "", in_c, a(), of.b >= 0 ? ", " : "",
              of.b >= 0 ? b() : "");
        } else if (of.b < 0) {
          Put("{}{}", in_c, a());
        } else {
          Put("{} {} {}", a(), in_c, b());
        }
        text_ += ";\n";
    }
    if (room_[node] >= 0) Put("  w[{}] = v{};\n", room_[node], node);
    for (const std::size_t i : results_[node]) {
      Put("  y[{}] = {};\n", i, Name(node, function));
    }
    for (const Comparison* test : tests_[node]) {
      const char* relation = test->relation == Relation::kLess        ? "<"
                             : test->relation == Relation::kLessEqual ? "<="
                                                                      : "==";
      Put("  ok &= {}({} {} {});\n",
          test->outcome ? ""
          : has_lanes_  ? "~"
                        : "!",
          Name(test->a, function), relation, Name(test->b, function));
    }
  }

  const Form form_;
  const bool own_sines_;
  const bool has_lanes_;
  const char* const number_;  ///< its type in C
  const std::string parameters_, arguments_;
  const Graph& graph_;
  const std::vector<int>& outputs_;
  const std::string name_;
  std::vector<bool> live_;
  std::vector<std::vector<std::size_t>> results_;      ///< indices of outputs, by node
  std::vector<std::vector<const Comparison*>> tests_;  ///< by their later node
  std::vector<int> function_, room_, places_;          ///< by node
  std::vector<int> sines_in_;                          ///< last function with those of an angle
  int num_functions_ = 0, num_room_ = 0;
  std::string text_;
};

}  // namespace

std::string PrintFunction(const RecordedFunction& recorded, const std::string& name, int* room) {
  Printer printer(recorded, name, Form::kLiterals);
  *room = printer.room();
  return printer.Text();
}

std::string PrintLibrary(const RecordedFunction& recorded, bool own_sines) {
  Printer printer(recorded, "function", Form::kConstants, own_sines);
  return fmt::format(R"(#include <math.h>
static void (*sines)(double, double*, double*);
void loopbench_use_sines(void (*of_pose)(double, double*, double*)) {{ sines = of_pose; }}
{}{}const int loopbench_room = {};
int loopbench_function(const double* x, const double* c, double* y, double* w) {{
  return function(x, c, y, w);
}}
)",
                     kPrintedHelpers, printer.Text(), printer.room());
}

std::vector<double> ConstantsOf(const RecordedFunction& recorded) {
  std::vector<double> constants;
  for (const int node : recorded.graph.Given(recorded.outputs)) {
    constants.push_back(recorded.graph.nodes()[node].value);
  }
  return constants;
}

std::string PrintLanes(const RecordedFunction& recorded, int lanes, bool own_sines) {
  Printer printer(recorded, "function", Form::kLanes, own_sines);
  return fmt::format(R"(#define LANES {}
{}{}const int loopbench_room = {};
int loopbench_function(const double* x, const double* c, double* y, double* w) {{
  const holds ok = function((const number*)x, (const number*)c, (number*)y, (number*)w);
  int bits = 0;
  for (int i = 0; i < LANES; ++i) bits |= ok[i] != 0 ? 1 << i : 0;
  return bits;
}}
)",
                     lanes, kLaneHelpers, printer.Text(), printer.room());
}

}  // namespace loopbench::generate
