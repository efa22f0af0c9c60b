#include <fmt/format.h>

#include <boost/crc.hpp>
#include <cstdint>

#include "harness/base/text.h"
#include "harness/exchange/export_c.h"
#include "harness/exchange/export_names.h"
#include "harness/generate/generated.h"

namespace loopbench::exchange {

namespace {

using fmt::format;

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
  std::string unit_list;
  for (const std::string& unit : units) unit_list += Unit(unit);
  const auto unknowns = [](std::size_t from, std::size_t to) {
    std::string text;
    for (std::size_t i = from; i < to; ++i)
      text += format("      <Unknown index=\"{}\"/>\n", i + 1);
    return text;
  };
  return format(fmt::runtime(Template("modelDescription.xml")),
                fmt::arg("name", EscapeXmlAttribute(name)), fmt::arg("guid", guid),
                fmt::arg("id", code.identifier), fmt::arg("units", unit_list),
                fmt::arg("step", NumberText(step)), fmt::arg("variables", list),
                fmt::arg("state_outputs", unknowns(0, states)),
                fmt::arg("outputs", unknowns(2 * states, variables.size())),
                fmt::arg("rates", unknowns(states, 2 * states)));
}

}  // namespace

std::string MakeFmu(const Code& code, const std::string& model_name, double step) {
  std::map<std::string, std::string> words = WordsOf(code);
  words["POSE"] = std::to_string(code.pose_words.size());
  words["STEP"] = NumberText(step);
  const CodeFile* header = &code.files[0];
  const CodeFile* source = &code.files[1];
  const std::string all = Filled("fmi2.c", words) + header->text + source->text +
                          Description(code, model_name, "", step);
  const std::string guid = harness::Fnv1a(all) + harness::Fnv1a(harness::Fnv1a(all) + all);
  words["GUID"] = guid;
  const std::string functions = Filled("fmi2.c", words);
  const std::string fmi = format("fmi2_{}.c", code.identifier);
  const harness::TemporaryFolder folder("loopbench-fmu");
  harness::WriteFileAtomically(folder.path() / header->name, header->text);
  harness::WriteFileAtomically(folder.path() / source->name, source->text);
  harness::WriteFileAtomically(folder.path() / fmi, functions);
  const std::string binary = (folder.path() / (code.identifier + ".so")).string();
  // for every processor of this architecture, not only the present one
  generate::RunCompiler(
      {"-std=c99", "-O2", "-fPIC", "-shared", "-ffp-contract=off", "-fvisibility=hidden",
       "-DFMI2_OVERRIDE_FUNCTION_PREFIX", "-o", binary, (folder.path() / source->name).string(),
       (folder.path() / fmi).string(), "-lm"},
      folder.path());
  ZipArchive archive;
  archive.Add("modelDescription.xml", Description(code, model_name, guid, step));
  archive.Add("sources/" + header->name, header->text);
  archive.Add("sources/" + source->name, source->text);
  archive.Add("sources/" + fmi, functions);
  archive.Add(format("binaries/linux64/{}.so", code.identifier), harness::ReadFile(binary));
  return archive.Bytes();
}

}  // namespace loopbench::exchange
