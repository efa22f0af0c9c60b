// Where output goes: into devices and pipes, through links, never onto an input; and that a signal
// leaves no temporary file.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/harness/cli_fixture.h"

namespace loopbench::harness::output_test {

class OutputFiles : public CommandLineTest {
 protected:
  fs::path At(const std::string& name) const { return folder_ / name; }
};

TEST_F(OutputFiles, GoesThroughLinks) {
  Write("target", "old");
  fs::create_symlink("target", At("link"));
  fs::create_symlink("link", At("second"));
  WriteFileAtomically(At("second"), "new");
  EXPECT_EQ(ReadFile(At("target")), "new");
  EXPECT_TRUE(fs::is_symlink(At("second")) && fs::is_symlink(At("link")));
  // to a name that is new, and into a folder elsewhere
  fs::create_directory(At("folder"));
  fs::create_symlink("folder/new", At("dangling"));
  WriteFileAtomically(At("dangling"), "made");
  EXPECT_TRUE(fs::is_symlink(At("dangling")));
  EXPECT_EQ(ReadFile(At("folder/new")), "made");
  fs::create_symlink("circle", At("circle"));
  ExpectWords(MessageOf<std::runtime_error>([&] { WriteFileAtomically(At("circle"), "x"); }),
              {"symbolic links"});
  fs::create_symlink("nowhere/x", At("lost"));
  ExpectWords(MessageOf<std::runtime_error>([&] { WriteFileAtomically(At("lost"), "x"); }),
              {"No such file"});
}

TEST_F(OutputFiles, GoesIntoDevicesAndPipes) {
  ASSERT_EQ(::mkfifo(At("pipe").c_str(), 0600), 0);
  std::string read;
  std::thread reader([&] {
    const int pipe = ::open(At("pipe").c_str(), O_RDONLY);
    char buffer[64];
    for (ssize_t n; (n = ::read(pipe, buffer, sizeof buffer)) > 0;) {
      read.append(buffer, static_cast<std::size_t>(n));
    }
    ::close(pipe);
  });
  WriteFileAtomically(At("pipe"), "through");
  reader.join();
  EXPECT_EQ(read, "through");
  EXPECT_TRUE(fs::is_fifo(At("pipe")));
  // by links: a mistake here then costs a link, and no device
  fs::create_symlink("/dev/null", At("null"));
  fs::create_symlink("/dev/full", At("full"));
  WriteFileAtomically(At("null"), "gone");
  EXPECT_TRUE(fs::is_character_file(At("null")));
  EXPECT_THROW(WriteFileAtomically(At("full"), "x"), SystemFault);
  EXPECT_TRUE(fs::is_symlink(At("full")));
  ExpectWords(MessageOf<std::runtime_error>([&] { WriteFileAtomically(folder_, "x"); }),
              {"found a folder"});
}

TEST_F(OutputFiles, GoesToStandardOutputBehindWhatWasPrinted) {
  Expect("run tiny.json --out out", 0);
  for (const std::string out : {"/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"}) {
    const std::string table = "table out --format csv --out " + out;
    Expect("", 0, {}, "'" LOOPBENCH_BINARY "' " + table + " > text 2> messages; exit $?;");
    const std::string text = ReadFile(At("text"));
    EXPECT_TRUE(text.starts_with("experiment,mechanism,")) << text;
    ExpectNone(text, {"wrote"});
    ExpectWords(ReadFile(At("messages")), {"wrote " + out});
    Expect(table, 0, {"experiment,mechanism,", "wrote " + out});  // a pipe
  }
  Expect("view four-bar.json --format svg --out /dev/stdout", 0, {"<svg", "wrote"});
  // messages go to standard error
  const std::string svg =
      Call("", "'" LOOPBENCH_BINARY
               "' view four-bar.json --format svg --out /dev/stdout 2>err; exit $?;")
          .text;
  EXPECT_TRUE(svg.starts_with("<")) << svg.substr(0, 100);
  EXPECT_TRUE(svg.ends_with("</svg>\n")) << svg.substr(svg.size() - 100);
  // also of commands that work in a process of their own
  for (const auto& [command, begin] :
       {std::pair{"count four-bar.json --format csv --out", "mechan"},
        {"generate four-bar.json --out code --fmu", "PK"}}) {
    const std::string call = std::string("'" LOOPBENCH_BINARY "' ") + command;
    EXPECT_TRUE(Call("", call + " /dev/stdout 2>other; exit $?;").text.starts_with(begin)) << call;
  }
  EXPECT_EQ(ReadFile(At("err")).substr(0, 17), "wrote /dev/stdout");
}

TEST_F(OutputFiles, KeepsWhatAFileMayBe) {
  Write("private", "old");
  fs::permissions(At("private"), fs::perms::owner_read | fs::perms::owner_write);
  WriteFileAtomically(At("private"), "new");
  EXPECT_EQ(fs::status(At("private")).permissions(),
            fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(OutputFiles, OntoAnInputIsRefused) {
  Write("input", "text");
  fs::create_symlink("input", At("link"));
  fs::create_hard_link(At("input"), At("hard"));
  {
    const CommandInputs inputs;
    EXPECT_EQ(ReadFile(At("link")), "text");
    for (const char* name : {"input", "link", "hard", "./input"}) {
      ExpectWords(MessageOf<std::runtime_error>([&] { WriteFileAtomically(At(name), "x"); }),
                  {"an input of this command"});
      ExpectWords(MessageOf<std::runtime_error>([&] { RequireOutput(At(name)); }),
                  {"an input of this command"});
    }
    WriteFileAtomically(At("other"), "x");
  }
  EXPECT_EQ(ReadFile(At("input")), "text");
  WriteFileAtomically(At("input"), "x");  // the command is over
  EXPECT_EQ(NamesIn(folder_), (std::vector<std::string>{"claims.json", "four-bar.json", "hard",
                                                        "input", "link", "other", "tiny.json"}));
}

// Each option that names a file, of each command that has one.
TEST_F(OutputFiles, OfEveryCommandGoesTheSameWay) {
  Write("moving.json", TinyWith(R"("output": {"step": 0.1})"));
  Expect("run moving.json --out store", 0);
  fs::copy(At("store"), At("copy"), fs::copy_options::recursive);
  Expect("trajectory store --out csv", 0);
  const std::vector<std::string> motions = NamesIn(At("csv"));
  ASSERT_EQ(motions.size(), 2u);
  const std::string motion = "csv/" + motions.front();
  Expect("history add store --store past --commit a --date 2026-01-01", 0);
  Write(
      "b.json",
      R"({"benchmarks": [{"name": "rhs/chain/3/odca/acceleration/joint/rank-revealing", "cpu_time": 1, "real_time": 1},
    {"name": "rhs/chain/30/odca/acceleration/joint/rank-revealing", "cpu_time": 10, "real_time": 10}]})");
  const std::string store = "store/results.jsonl";
  const std::vector<std::string> kept = {
      "store/trajectories/" + NamesIn(At("store/trajectories")).front(),
      "store/mechanisms/" + NamesIn(At("store/mechanisms")).front()};
  // commands that write one file, each with its output last, and the inputs that it must not be
  for (const auto& [command, inputs] : std::map<std::string, std::vector<std::string>>{
           {"table store --format csv --out ", {store}},
           {"view four-bar.json --format html --out ", {"four-bar.json"}},
           {"view four-bar.json --format svg --out ", {"four-bar.json"}},
           {"export-metrics store --out ", {store}},
           {"report store --out ", {store}},
           {"count four-bar.json --out ", {"four-bar.json"}},
           {"fit-scaling b.json --out ", {"b.json"}},
           {"export-mechanism four-bar.json --to mjcf --out ", {"four-bar.json"}},
           {"compare store copy --markdown ", {store, "copy/results.jsonl"}},
           {"compare store copy --junit ", {store, "copy/results.jsonl"}},
           {"check-claims store --claims claims.json --out ", {store, "claims.json"}},
           {"history report --store past --out ", {"past/history.jsonl"}},
           {"trajectory " + motion + " --out ", {motion}}}) {
    SCOPED_TRACE(command);
    Write("target", "old");
    fs::remove(At("there"));
    fs::create_symlink("target", At("there"));
    Expect(command + "there", 0);
    EXPECT_TRUE(fs::is_symlink(At("there")));
    EXPECT_NE(ReadFile(At("target")), "old");
    fs::remove(At("there"));
    ASSERT_EQ(::mkfifo(At("there").c_str(), 0600), 0);
    Expect(command + "there", 0, {}, "{ timeout 60 cat there > read & } &&");
    EXPECT_TRUE(fs::is_fifo(At("there")));
    fs::remove(At("there"));
    for (const std::string& input : inputs) {
      const std::string before = ReadFile(At(input));
      fs::create_symlink(input, At("there"));
      for (const std::string& path : {input, std::string("there")}) {
        Expect(command + path, 2, {"found an input of this command"});
      }
      fs::remove(At("there"));
      EXPECT_EQ(ReadFile(At(input)), before) << input;
    }
    for (const std::string& file : kept) {
      const std::string before = ReadFile(At(file));
      fs::create_symlink(file, At("there"));
      for (const std::string& path : {file, std::string("there")}) {
        Expect(command + path, 2, {"cannot write '" + path + "': found a"});
      }
      fs::remove(At("there"));
      EXPECT_EQ(ReadFile(At(file)), before) << file;
    }
  }
}

TEST_F(OutputFiles, IsAskedForBeforeAnythingIsMeasured) {
  Write("file", "no folder");
  const Ending refused = Call("baseline renew --experiments tiny.json --dir file/dir");
  ExpectEnding(refused, 2, {"cannot write 'file/dir/results.jsonl'", "Not a directory"});
  ExpectNone(refused.text, {"runs"});
  Expect("advise four-bar.json --out file/x", 2, {"cannot write 'file/x'"});
  Expect("advise four-bar.json --out four-bar.json", 2, {"an input of this command"});
}

/// Forks a process that calls `work`, waits until it is ready, and ends it.
int EndedBy(int signal, const std::function<void()>& work) {
  int ready[2];
  EXPECT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(signal, SIG_DFL);
    work();
    EXPECT_EQ(::write(ready[1], "x", 1), 1);
    for (;;) ::pause();
  }
  char byte = 0;
  EXPECT_EQ(::read(ready[0], &byte, 1), 1);
  ::kill(child, signal);
  int status = 0;
  ::waitpid(child, &status, 0);
  for (const int end : ready) ::close(end);
  return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
}

TEST_F(OutputFiles, ProgramsEndWithTheProcessThatRunsThem) {
  const fs::path file = At("pid");
  const auto work = [&file] {
    const std::string script = "echo $$ > '" + file.string() + "'; exec sleep 60";
    std::thread([script] { RunProgram({"sh", "-c", script}); }).detach();
    while (!fs::exists(file) || fs::file_size(file) == 0) ::usleep(1000);
  };
  EXPECT_EQ(EndedBy(SIGKILL, work), SIGKILL);
  const std::string stat = "/proc/" + std::to_string(std::stoi(ReadFile(file))) + "/stat";
  const auto runs = [&stat] {  // a zombie, which nobody may collect, does not
    std::ifstream stream(stat);
    std::string text;
    return std::getline(stream, text) && text.find(") Z") == text.npos;
  };
  for (int i = 0; i < 1000 && runs(); ++i) ::usleep(10'000);
  EXPECT_FALSE(runs());
}

TEST_F(OutputFiles, UnderWayIsRemovedBySignals) {
  const fs::path tmp = At("tmp");
  fs::create_directory(tmp);
  const char* before = std::getenv("TMPDIR");
  const std::string kept = before == nullptr ? "" : before;
  ::setenv("TMPDIR", tmp.c_str(), 1);
  const auto work = [&] {
    auto* folder = new TemporaryFolder("gone");
    WriteFileAtomically(folder->path() / "a/b", "x");
    auto* file = new OutputFile(tmp / "out");
    file->Write("half of it");
  };
  for (const int signal : {SIGTERM, SIGHUP, SIGINT}) {
    EXPECT_EQ(EndedBy(signal, work), signal);
    EXPECT_EQ(NamesIn(tmp).size(), 0u) << signal;
  }
  // no process can handle this one: the next folder of the name removes the leftovers
  EXPECT_EQ(EndedBy(SIGKILL, [] { new TemporaryFolder("gone"); }), SIGKILL);
  EXPECT_EQ(NamesIn(tmp).size(), 1u);
  fs::create_directory(tmp / "gone.tmp-mine-is-longer");
  {
    const TemporaryFolder living("gone"), another("gone"), other("other");
    EXPECT_TRUE(fs::exists(living.path())) << "its lock keeps it";
    EXPECT_EQ(NamesIn(tmp).size(), 4u);
  }
  EXPECT_EQ(NamesIn(tmp).size(), 1u);
  if (kept.empty()) {
    ::unsetenv("TMPDIR");
  } else {
    ::setenv("TMPDIR", kept.c_str(), 1);
  }
}

TEST_F(OutputFiles, OfKilledProcessesAreRemovedByTheNextRun) {
  const fs::path tmp = At("out/references/x.json"), table = At("out/drift.csv");
  const auto work = [&] {
    for (const fs::path& path : {tmp, table}) (new OutputFile(path))->Write("half of it");
  };
  EXPECT_EQ(EndedBy(SIGKILL, work), SIGKILL);
  EXPECT_EQ(NamesIn(tmp.parent_path()).size(), 1u);
  EXPECT_EQ(NamesIn(At("out")).size(), 2u);
  OutputFile living(table);
  // names that only look alike
  const std::set<std::string> kept = {"drift.csv.tmp", "1-2.tmp", "a.0-1.tmp", "b.1-2.tmpx",
                                      ".tmp"};
  for (const std::string& name : kept) Write("out/references/" + name, "mine");
  // locked by a process of another machine: nobody here has its number
  const pid_t ended = ::fork();
  if (ended == 0) ::_exit(0);
  ::waitpid(ended, nullptr, 0);
  const fs::path far = tmp.parent_path() / fmt::format("y.json.{}-0.tmp", ended);
  Write("out/references/" + far.filename().string(), "far");
  const int lock = ::open(far.c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_EQ(::flock(lock, LOCK_EX), 0);
  Expect("run tiny.json --out out", 0, {"ran 2 cases"});
  EXPECT_EQ(NamesIn(tmp.parent_path()).size(), kept.size() + 1);
  for (const std::string& name : kept) EXPECT_TRUE(fs::exists(tmp.parent_path() / name)) << name;
  EXPECT_TRUE(fs::exists(far));
  living.Finish();
  ::close(lock);
  Expect("run tiny.json --out out", 0, {"2 reused"});
  EXPECT_FALSE(fs::exists(far));
  for (const auto& entry : fs::directory_iterator(At("out"))) {
    EXPECT_NE(entry.path().extension(), ".tmp") << entry.path();
  }
}

TEST(Files, ANewFileOfAKilledWriterIsNotThere) {
  const TemporaryFolder folder("loopbench-files");
  const std::filesystem::path path = folder.path() / "new";
  const std::string text(1 << 16, 'x');
  const auto write_and_be_killed = [&] {
    const rlimit half = {text.size() / 2, text.size() / 2};
    ::setrlimit(RLIMIT_FSIZE, &half);
    std::signal(SIGXFSZ, SIG_DFL);
    WriteNewFile(path, text);
  };
  EXPECT_EXIT(write_and_be_killed(), ::testing::KilledBySignal(SIGXFSZ), "");
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_TRUE(WriteNewFile(path, text));
  EXPECT_EQ(ReadFile(path), text);
  EXPECT_FALSE(WriteNewFile(path, "another"));
  EXPECT_EQ(ReadFile(path), text);
}

TEST(Files, ANewFileLeavesNothingBesideIt) {
  const TemporaryFolder folder("loopbench-files");
  for (const char* text : {"first", "second"}) WriteNewFile(folder.path() / "new", text);
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    EXPECT_EQ(entry.path().filename(), "new");
  }
}

}  // namespace loopbench::harness::output_test
