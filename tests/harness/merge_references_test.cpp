// Certified references go with the stores that are merged.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "harness/base/text.h"
#include "harness/observers/reference.h"
#include "tests/harness/cli_fixture.h"
#include "tests/reference/cases.h"

namespace loopbench::harness {
namespace merge_references_test {

MechanismDescription Pendulum() {
  return ReadMechanism(kConfigs / "mechanisms/pendulum.json").description;
}

/// Two pictures of a pendulum that hangs, certified to `bound` until `until`.
Reference Certificate(double bound, double until, double cpu_s = 1.0) {
  Reference reference;
  reference.scalar = "long-double";
  reference.times = {0.0, 1.0};
  const MechanismDescription user = Pendulum();
  reference.snapshots.assign(2, {.bodies = std::vector<BodyState>(user.bodies.size()),
                                 .joints = std::vector<double>(user.joints.size())});
  reference.bounds.assign(2, {.position = bound});
  reference.trust_horizon = until;
  reference.cpu_s = cpu_s;
  return reference;
}

class MergeReferencesTest : public CommandLineTest {
 protected:
  void SetUp() override {
    CommandLineTest::SetUp();
    ExpectEnding(Call("run tiny.json --no-timing --shard 1/2 --out a"), 0, {});
    ExpectEnding(Call("run tiny.json --no-timing --shard 2/2 --out b"), 0, {});
  }
  fs::path File(const std::string& store, const std::string& id) const {
    return ReferencePath(folder_ / store / "results.jsonl", id);
  }
  void Certify(const std::string& store, const std::string& id, const Reference& reference) const {
    WriteReference(File(store, id), id, Pendulum(), reference);
  }
};

TEST_F(MergeReferencesTest, AreThoseOfAllStores) {
  Certify("a", "0000000000000001", Certificate(1e-15, 1.0));
  Certify("a", "0000000000000002", Certificate(1e-15, 1.0));
  Certify("b", "0000000000000002", Certificate(1e-15, 1.0, 7.0));  // as good, made more slowly
  Certify("b", "0000000000000003", Certificate(1e-14, 0.0));
  const Ending merged = Call("merge a b --out m");
  ExpectEnding(merged, 0, {"3 references beside it"});
  EXPECT_EQ(merged.text.find("is kept"), std::string::npos) << merged.text;
  for (const auto& [store, id] :
       {std::pair("a", "0000000000000001"), {"a", "0000000000000002"}, {"b", "0000000000000003"}}) {
    EXPECT_EQ(ReadFile(File("m", id)), ReadFile(File(store, id))) << id;
    EXPECT_TRUE(ReadReference(File("m", id), id, Pendulum()));
  }
}

TEST_F(MergeReferencesTest, KeepTheFinerCertificateInAnyOrderAndSayIt) {
  const std::string longer = "0000000000000001", finer = "0000000000000002";
  Certify("a", longer, Certificate(1e-15, 0.0));
  Certify("b", longer, Certificate(1e-15, 1.0));
  Certify("a", finer, Certificate(1e-17, 1.0));
  Certify("b", finer, Certificate(1e-15, 1.0));
  for (const std::string order : {"a b", "b a"}) {
    const Ending merged = Call("merge " + order + " --out m");
    ExpectEnding(merged, 0, {"two certificates of one reference", longer, finer, "is kept"});
    EXPECT_EQ(ReadFile(File("m", longer)), ReadFile(File("b", longer)));
    EXPECT_EQ(ReadFile(File("m", finer)), ReadFile(File("a", finer)));
    fs::remove_all(folder_ / "m");
  }
}

TEST_F(MergeReferencesTest, AreRefusedDamagedOrUnderAnotherNameBeforeAnythingIsWritten) {
  const std::string id = "0000000000000001";
  Certify("b", id, Certificate(1e-15, 1.0));
  const std::string sound = ReadFile(File("b", id));
  std::string changed = sound;
  changed.replace(changed.find("long-double"), 4, "shor");
  WriteFileAtomically(File("b", id), changed);
  ExpectEnding(Call("merge a b --out m"), 2, {"0000000000000001.json", "checksum"});
  EXPECT_FALSE(fs::exists(folder_ / "m"));
  WriteFileAtomically(File("b", id), sound);
  fs::rename(File("b", id), File("b", "0000000000000002"));
  ExpectEnding(Call("merge a b --out m"), 2,
               {"found reference \"0000000000000001\", expected \"0000000000000002\""});
  EXPECT_FALSE(fs::exists(folder_ / "m"));
}

}  // namespace merge_references_test
}  // namespace loopbench::harness
