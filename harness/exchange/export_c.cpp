#include "harness/exchange/export_c.h"

#include <boost/crc.hpp>
#include <cctype>

#include "harness/base/text.h"
#include "harness/exchange/export_names.h"
#include "harness/generate/generated.h"
#include "harness/generate/graph.h"
#include "harness/generate/record.h"
#include "mechanism/model/mechanism.h"

namespace loopbench::exchange {

namespace {

using fmt::format;
using generate::Quantity, generate::RecordedFunction;

std::string IdentifierOf(const std::string& name) {
  std::string identifier;
  for (const char c : name) {
    const bool keeps =
        std::isalnum(static_cast<unsigned char>(c)) != 0 && static_cast<unsigned char>(c) < 0x80;
    identifier += keeps ? static_cast<char>(std::tolower(c)) : '_';
  }
  const bool is_name =
      !identifier.empty() && std::isalpha(static_cast<unsigned char>(identifier[0])) != 0;
  return is_name ? identifier : "mechanism_" + identifier;
}

/// Recordings of one function along one motion, one per branch.
struct Branches {
  std::vector<RecordedFunction> recorded;
  std::size_t missed = 0;
};

std::vector<double> Inputs(const MotionState& state) {
  std::vector<double> x = {state.t};
  x.insert(x.end(), state.y.begin(), state.y.end());
  return x;
}

/// Returns true if a branch covers a state: comparisons agree and the result is finite.
bool Covers(const RecordedFunction& branch, const MotionState& state) {
  const std::vector<double> values = branch.graph.Values(Inputs(state));
  return branch.graph.Holds(values) &&
         std::ranges::all_of(branch.outputs, [&](int node) { return std::isfinite(values[node]); });
}

Branches RecordAlong(const CodeRequest& request, Quantity quantity) {
  generate::RecordingSubject subject = request.subject;
  subject.quantity = quantity;
  Branches branches;
  // A recording chooses its mode, such as released directions, at its start. It starts earlier than
  // it records, because checks of accepted steps must not become branches.
  const auto start_at = [&](const MotionState& state) {
    const auto num_q = request.start.q.size(), num_u = request.start.u.size();
    if (std::ssize(state.y) != num_q + num_u) return request.start;  // without some speeds
    return generate::RecordingStart{
        .t = state.t - 1e-9,
        .q = Eigen::Map<const Eigen::VectorXd>(state.y.data(), num_q),
        .u = Eigen::Map<const Eigen::VectorXd>(state.y.data() + num_q, num_u)};
  };
  const auto record = [&](const MotionState& state) {
    RecordedFunction recorded =
        generate::RecordFunction(subject, start_at(state), state.t, state.y);
    recorded.graph.ForgetZeroTests();
    generate::RequireShort(recorded);
    return recorded;
  };
  for (const MotionState& state : request.motion) {
    const auto covers = [&](const RecordedFunction& branch) { return Covers(branch, state); };
    if (std::ranges::any_of(branches.recorded, covers)) continue;
    if (std::ssize(branches.recorded) >= kMaxCodeBranches) {
      ++branches.missed;
      continue;
    }
    // next to the state, where no number is zero by chance
    MotionState near = state;
    for (std::size_t i = 0; i < near.y.size(); ++i) near.y[i] += generate::ShiftOf(i);
    near.t += generate::ShiftOf(near.y.size());
    try {
      branches.recorded.push_back(record(near));
      if (!covers(branches.recorded.back())) branches.recorded.push_back(record(state));
    } catch (const generate::NotCovered&) {
      if (branches.recorded.empty()) throw;
      ++branches.missed;
    }
  }
  return branches;
}

/// Returns the Jacobian with respect to the state, of each branch at its recorded state.
Branches JacobianOf(const Branches& derivative, const CodeRequest& request) {
  Branches jacobian = derivative;
  for (RecordedFunction& branch : jacobian.recorded) {
    // the numbers only select operands of minima and maxima
    std::vector<double> values;
    for (const MotionState& state : request.motion) {
      values = branch.graph.Values(Inputs(state));
      if (Covers(branch, state)) break;
    }
    branch.outputs = generate::Differentiate(
        branch.graph, branch.outputs, {branch.inputs.begin() + 1, branch.inputs.end()}, values);
  }
  return jacobian;
}

constexpr const char* kSines = R"(static void sines(double angle, double* sine, double* cosine) {
  *sine = sin(angle);
  *cosine = cos(angle);
}
)";

/// Writes the texts of the files.
class Writer {
 public:
  Writer(const CodeRequest& request, Code& code) : request_(request), code_(code) {
    words_ = WordsOf(code);
    words_["STATES"] = std::to_string(code.state_names.size());
    words_["POSITIONS"] = std::to_string(code.num_q);
    words_["BODIES"] = std::to_string(code.body_names.size());
    words_["CONSTRAINTS"] = std::to_string(code.num_rows);
    words_["STEP"] = NumberText(request.step);
  }

  void Write() {
    const Branches derivative = RecordAlong(request_, Quantity::kDerivative);
    Add("derivative", "dy/dt", derivative, "dydt");
    Add("jacobian", "d(dy/dt)/dy by columns: dfdy[i + STATES * j] = d(dydt[i])/d(y[j])",
        JacobianOf(derivative, request_), "dfdy");
    Add("energy", "kinetic and potential energy [J]", RecordAlong(request_, Quantity::kEnergy),
        "energy");
    Add("poses",
        code_.pose_words.size() == 4
            ? "of each body: centre of mass x, y [m], cosine and sine of the angle"
            : "of each body: centre of mass x, y, z [m], rotation matrix by rows",
        RecordAlong(request_, Quantity::kPoses), "poses");
    if (code_.num_rows > 0) {
      Add("violation", "constraint violation: positions [m, rad], then speeds [m/s, rad/s]",
          RecordAlong(request_, Quantity::kViolation), "violation");
      Add("correction", "y after one Newton step toward the constraints",
          RecordAlong(request_, Quantity::kCorrection), "corrected");
    }
    std::string comment;
    for (const std::string& line : request_.provenance) comment += CommentLines("// ", line);
    std::map<std::string, std::string> header = words_;
    header["DECLARATIONS"] = declarations_;
    code_.files = {{code_.identifier + ".h", comment + Filled("model.h", header)},
                   {code_.identifier + ".c", comment + Source()},
                   {code_.identifier + "_example.c", comment + Filled("example.c", words_)},
                   {"CMakeLists.txt", Filled("CMakeLists.txt", words_)}};
  }

 private:
  void Add(const std::string& name, const std::string& meaning, const Branches& branches,
           const std::string& result) {
    const RecordedFunction& first = branches.recorded.front();
    code_.functions.push_back(
        {.name = name,
         .branches = static_cast<int>(branches.recorded.size()),
         .operations = first.graph.Count(first.graph.Live(first.outputs, true)).flops(),
         .missed = branches.missed});
    const std::string head =
        format("int {}_{}(double t, const double* y, double* {})", code_.identifier, name, result);
    declarations_ += format("/* {} */\n{};\n", meaning, head);
    std::string calls;
    int most_room = 1;
    for (std::size_t i = 0; i < branches.recorded.size(); ++i) {
      const std::string function = format("{}_{}", name, i);
      int room = 0;
      functions_ += generate::PrintFunction(branches.recorded[i], function, &room);
      most_room = std::max(most_room, room);
      calls += format("{}{}(x, {}, w)", i == 0 ? "" : " || ", function, result);
    }
    std::map<std::string, std::string> words = words_;
    words["HEAD"] = head;
    words["ROOM"] = std::to_string(most_room);
    words["CALLS"] = calls;
    words["OUTPUTS"] = std::to_string(first.outputs.size());
    words["RESULT"] = result;
    functions_ += Filled("call.c", words);
  }

  std::string Strings(const std::string& name, const std::string& size,
                      const std::vector<std::string>& strings) const {
    std::string text = format("const char* const {}_{}[{}_{}] = {{\n", words_.at("ID"), name,
                              words_.at("UP"), size);
    for (const std::string& string : strings) text += format("    {},\n", QuoteCpp(string));
    return text + "};\n";
  }

  std::string Source() const {
    const auto calls = [&](const char* function) {
      return functions_.find(function) != std::string::npos;
    };
    std::string text = Fill("\n#include \"@ID@.h\"\n\n#include <math.h>\n\n", words_);
    // compilers warn about functions that are not called
    if (calls(" least(") || calls(" most(")) text += generate::kPrintedHelpers;
    if (calls(" sines(")) text += kSines;
    text += functions_ + Strings("state_names", "STATES", code_.state_names) +
            Strings("state_units", "STATES", code_.state_units) +
            Strings("body_names", "BODIES", code_.body_names);
    text += Fill("\nvoid @ID@_start(double* t, double* y) {\n", words_) +
            format("  *t = {:a};\n", request_.motion.front().t);
    for (std::size_t i = 0; i < code_.start.size(); ++i) {
      text += format("  y[{}] = {:a}; /* {} */\n", i, code_.start[i], NumberText(code_.start[i]));
    }
    return text + "}\n" + Filled(code_.num_rows == 0 ? "no_project.c" : "project.c", words_) +
           Filled("step.c", words_);
  }

  const CodeRequest& request_;
  Code& code_;
  std::map<std::string, std::string> words_;
  std::string declarations_, functions_;
};

using Labelled = std::pair<std::string, std::string>;  ///< a name with its unit

/// Returns names of all positions or all speeds of a mechanism, in order.
template <class Space>
std::vector<Labelled> Coordinates(const MechanismDescription& description,
                                  const Mechanism<Space, double>& mechanism, bool speeds) {
  std::vector<Labelled> labels(
      static_cast<std::size_t>(speeds ? mechanism.num_u() : mechanism.num_q()));
  for (std::size_t i = 0; i < mechanism.joints().size(); ++i) {
    const loopbench::Joint<Space, double>& joint = mechanism.joints()[i];
    if (!joint.in_tree()) continue;
    const JointType type =
        joint.description < 0 ? JointType::kFree : description.joints[joint.description].type;
    auto at = static_cast<std::size_t>(speeds ? joint.u_offset : joint.q_offset);
    int coordinate = 0;
    for (const ValueWord& word : ValueWords(TraitsOf(type), description.space, speeds)) {
      if (mechanism.DriveOf(joint, coordinate++) >= 0) continue;
      const bool is_speed_word = word.name.starts_with('w');  // wx, wy, wz
      labels[at++] = {format("{}.{}{}", mechanism.joint_names()[i], word.name,
                             speeds && !is_speed_word ? " speed" : ""),
                      word.unit.empty() ? "1" : std::string(word.unit)};
    }
  }
  return labels;
}

/// Sets sizes and names; speeds only if the state contains them.
template <class Space>
void Describe(const CodeRequest& request, const std::vector<int>& carried_speeds, Code& code) {
  const MechanismDescription& description = request.subject.description;
  const Mechanism<Space, double> mechanism(description, request.subject.coordinates);
  code.start = request.motion.front().y;
  if (Space::kRot == 1) {
    code.pose_words = {{"x", "m"}, {"y", "m"}, {"cos", "1"}, {"sin", "1"}};
  } else {
    code.pose_words = {{"x", "m"}, {"y", "m"}, {"z", "m"}};
    for (int i = 0; i < 9; ++i)
      code.pose_words.emplace_back(format("R{}{}", i / 3 + 1, i % 3 + 1), "1");
  }
  code.num_q = mechanism.num_q();
  code.num_rows = mechanism.num_equations();
  code.body_names.assign(mechanism.body_names().begin() + 1, mechanism.body_names().end());
  std::vector<Labelled> state = Coordinates<Space>(description, mechanism, false);
  const std::vector<Labelled> speeds = Coordinates<Space>(description, mechanism, true);
  for (const int i : carried_speeds) state.push_back(speeds[i]);
  UniqueNames names;
  for (const auto& [name, unit] : state) {
    code.state_names.push_back(names.Take(name));
    code.state_units.push_back(unit);
  }
}

/// A zip archive with uncompressed files (APPNOTE.TXT of PKWARE, sections 4.3.7, 4.3.12 and
/// 4.3.16). Dates are 1 January 1980, so that equal contents give equal bytes.
class ZipArchive {
 public:
  void Add(const std::string& name, const std::string& text) {
    boost::crc_32_type crc;
    crc.process_bytes(text.data(), text.size());
    const auto offset = static_cast<std::uint32_t>(bytes_.size());
    std::string head;
    Put(head, 20, 2);      // version required to extract
    Put(head, 0x0800, 2);  // names are UTF-8
    Put(head, 0, 2);       // stored
    Put(head, 0, 2);       // time
    Put(head, 0x0021, 2);  // date
    Put(head, crc.checksum(), 4);
    Put(head, text.size(), 4);
    Put(head, text.size(), 4);
    Put(head, name.size(), 2);
    Put(head, 0, 2);  // no extra field
    bytes_ += "PK\x03\x04" + head + name + text;
    directory_ += "PK\x01\x02";
    Put(directory_, 0x0314, 2);  // made on Unix
    directory_ += head;
    Put(directory_, 0, 2);  // no comment
    Put(directory_, 0, 2);  // disk
    Put(directory_, 0, 2);  // internal attributes
    Put(directory_, std::uint64_t{0100644} << 16, 4);
    Put(directory_, offset, 4);
    directory_ += name;
    ++files_;
  }

  std::string Bytes() const {
    std::string end = "PK\x05\x06";
    Put(end, 0, 4);  // disks
    Put(end, files_, 2);
    Put(end, files_, 2);
    Put(end, directory_.size(), 4);
    Put(end, bytes_.size(), 4);
    Put(end, 0, 2);  // no comment
    return bytes_ + directory_ + end;
  }

 private:
  static void Put(std::string& bytes, std::uint64_t number, int size) {
    for (int i = 0; i < size; ++i) bytes += static_cast<char>(number >> (8 * i) & 0xff);
  }

  std::string bytes_, directory_;
  int files_ = 0;
};

/// A variable of the model; its value reference is its index.
struct Variable {
  std::string name, unit;
  std::string attributes;  ///< attributes of <ScalarVariable>
  std::string real;        ///< attributes of <Real>
};

std::vector<Variable> Variables(const Code& code) {
  constexpr const char* kOutput =
      R"(causality="output" variability="continuous" initial="calculated")";
  std::vector<Variable> all;
  const std::size_t states = code.state_names.size();
  for (std::size_t i = 0; i < states; ++i) {
    all.push_back({code.state_names[i], code.state_units[i],
                   R"(causality="output" variability="continuous" initial="exact")",
                   format(" start=\"{}\"", NumberText(code.start[i]))});
  }
  for (std::size_t i = 0; i < states; ++i) {
    const std::string& unit = code.state_units[i];
    const std::string rate = unit == "1" ? "1/s" : unit.ends_with("/s") ? unit + "2" : unit + "/s";
    all.push_back({format("der({})", code.state_names[i]), rate,
                   R"(causality="local" variability="continuous" initial="calculated")",
                   format(" derivative=\"{}\"", i + 1)});
  }
  all.push_back({"energy.kinetic", "J", kOutput, ""});
  all.push_back({"energy.potential", "J", kOutput, ""});
  for (const std::string& body : code.body_names) {
    for (const auto& [word, unit] : code.pose_words)
      all.push_back({format("{}.{}", body, word), unit, kOutput, ""});
  }
  UniqueNames names;
  for (Variable& variable : all) variable.name = names.Take(variable.name);
  return all;
}

/// Returns <Unit> with its exponents of kg, m, s and rad.
std::string Unit(const std::string& name) {
  static const std::map<std::string, const char*> kBase = {
      {"m", R"(m="1")"},           {"rad", R"(rad="1")"},          {"m/s", R"(m="1" s="-1")"},
      {"m/s2", R"(m="1" s="-2")"}, {"rad/s", R"(rad="1" s="-1")"}, {"rad/s2", R"(rad="1" s="-2")"},
      {"1/s", R"(s="-1")"},        {"J", R"(kg="1" m="2" s="-2")"}};
  const auto at = kBase.find(name);
  return format("    <Unit name=\"{}\"><BaseUnit{}{}/></Unit>\n", name,
                at == kBase.end() ? "" : " ", at == kBase.end() ? "" : at->second);
}

std::string Description(const Code& code, const std::string& name, const std::string& guid,
                        double step) {
  const std::vector<Variable> variables = Variables(code);
  const std::size_t states = code.state_names.size();
  std::set<std::string> units;
  std::string list;
  for (std::size_t i = 0; i < variables.size(); ++i) {
    const Variable& variable = variables[i];
    units.insert(variable.unit);
    list += format(
        "    <!-- {} -->\n    <ScalarVariable name=\"{}\" valueReference=\"{}\" {}>\n      <Real "
        "unit=\"{}\"{}/>\n    </ScalarVariable>\n",
        i + 1, EscapeXmlAttribute(variable.name), i, variable.attributes, variable.unit,
        variable.real);
  }
  const auto unknowns = [](std::size_t from, std::size_t to) {
    std::string text;
    for (std::size_t i = from; i < to; ++i)
      text += format("      <Unknown index=\"{}\"/>\n", i + 1);
    return text;
  };
  return format(
      fmt::runtime(Template("modelDescription.xml")), fmt::arg("name", EscapeXmlAttribute(name)),
      fmt::arg("guid", guid), fmt::arg("id", code.identifier),
      fmt::arg("units", harness::Joined(units, "", Unit)), fmt::arg("step", NumberText(step)),
      fmt::arg("variables", list), fmt::arg("state_outputs", unknowns(0, states)),
      fmt::arg("outputs", unknowns(2 * states, variables.size())),
      fmt::arg("rates", unknowns(states, 2 * states)));
}

}  // namespace

std::map<std::string, std::string> WordsOf(const Code& code) {
  std::string upper = code.identifier;
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return {{"ID", code.identifier}, {"UP", upper}};
}

Code MakeCode(const CodeRequest& request) {
  if (request.motion.front().y.empty() || request.start.q.size() == 0) {
    throw generate::NotCovered("prescribed motions leave no state to integrate");
  }
  for (const JointDescription& joint : request.subject.description.joints) {
    for (const PrescribedMotion& motion : joint.motions) {
      const auto* table = std::get_if<TimeTable>(&motion.value);
      if (table == nullptr || table->cubic) continue;
      throw generate::NotCovered("the motion of joint \"" + joint.name +
                                 "\" has jumps of speed, expected \"interpolation\": \"cubic\"");
    }
  }
  Code code;
  code.identifier = IdentifierOf(request.subject.description.name);
  const std::vector<int> carried =
      generate::RecordFunction(request.subject, request.start).carried_speeds;
  if (request.subject.description.space == SpaceKind::kPlanar) {
    Describe<Planar>(request, carried, code);
  } else {
    Describe<Spatial>(request, carried, code);
  }
  Writer(request, code).Write();
  return code;
}

std::string MakeFmu(const Code& code, const std::string& model_name, double step) {
  std::map<std::string, std::string> words = WordsOf(code);
  words["POSE"] = std::to_string(code.pose_words.size());
  words["STEP"] = NumberText(step);
  const std::string all = Filled("fmi2.c", words) + code.files[0].text + code.files[1].text +
                          Description(code, model_name, "", step);
  const std::string guid = harness::Fnv1a(all) + harness::Fnv1a(harness::Fnv1a(all) + all);
  words["GUID"] = guid;
  const std::string functions = Filled("fmi2.c", words);
  const std::string fmi = format("fmi2_{}.c", code.identifier);
  const harness::TemporaryFolder folder("loopbench-fmu");
  const std::vector<CodeFile> files = {code.files[0], code.files[1], {fmi, functions}};
  for (const auto& [name, text] : files) harness::WriteFileAtomically(folder.path() / name, text);
  const std::string binary = (folder.path() / (code.identifier + ".so")).string();
  // for every processor of this architecture, not only the present one
  generate::RunCompiler(
      {"-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off", "-fvisibility=hidden",
       "-DFMI2_OVERRIDE_FUNCTION_PREFIX", "-o", binary,
       (folder.path() / code.files[1].name).string(), (folder.path() / fmi).string(), "-lm"},
      folder.path());
  ZipArchive archive;
  archive.Add("modelDescription.xml", Description(code, model_name, guid, step));
  for (const auto& [name, text] : files) archive.Add("sources/" + name, text);
  archive.Add(format("binaries/linux64/{}.so", code.identifier), harness::ReadFile(binary));
  return archive.Bytes();
}

}  // namespace loopbench::exchange
