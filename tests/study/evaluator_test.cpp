#include "study/evaluator.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "server.h"

namespace topple::study {
namespace {

using Kind = Answer::Kind;

struct Model {
  explicit Model(const std::string& command, double timeout = 20, bool one_shot = false)
      : runner(make_evaluator(nlohmann::json{{"inputs", {"x", "y"}},
                                             {"identity", {{"command", command}}},
                                             {"settings", {{"timeout", timeout}, {"one_shot", one_shot}}}}
                                  .dump())) {}
  std::vector<Answer> ask(const std::vector<Point>& points) {
    std::vector<Answer> answers(points.size());
    runner(
        points, [&](std::size_t i, Answer a) { answers.at(i) = std::move(a); }, cancel);
    return answers;
  }
  Runner runner;
  std::atomic<bool> cancel = false;
};

/// A shell that takes the numbers out of each line: x, y, id, and n, the lines so far.
std::string shell(const std::string& body) {
  return "n=0; number() { expr \"$line\" : \".*\\\"$1\\\":\\([-0-9.e+]*\\)\"; }; while read -r line; do n=$((n + 1)); "
         "x=$(number x); y=$(number y); id=$(number id); " +
         body + "; done";
}

TEST(Evaluator, WritesPointsThatReadBackToTheSameBits) {
  const double third = 1.0 / 3;
  const std::string line = write_request(7, {"x", "y \"z\""}, {third, -1e-300});
  const auto j = nlohmann::json::parse(line);
  EXPECT_EQ(j["id"], 7);
  EXPECT_EQ(j["inputs"]["x"].get<double>(), third);
  EXPECT_EQ(j["inputs"]["y \"z\""].get<double>(), -1e-300);
  EXPECT_EQ(line.back(), '\n');
}

TEST(Evaluator, AnswersManyPointsFromOneProcess) {
  Model m(shell(R"(echo "{\"outputs\":{\"x\":$x,\"y\":$y,\"line\":$n},\"outcome\":\"ok\"}")"));
  for (int i = 1; i <= 3; ++i) {
    const Answer a = m.ask({{1.0 / i, 0.25}}).at(0);
    ASSERT_EQ(a.kind, Kind::Done) << a.text;
    EXPECT_EQ(a.outputs[0].second, 1.0 / i) << "every bit";
    EXPECT_EQ(a.outputs[1].second, 0.25);
    EXPECT_EQ(a.outputs[2].second, i) << "lines that this process read";
    EXPECT_EQ(a.outcome, "ok");
  }
}

TEST(Evaluator, TakesAnswersOfABatchInAnyOrder) {
  Model m(shell(R"(all="{\"id\":$id,\"z\":$x}
$all"; [ $n -lt 3 ] || echo "$all")"));
  const std::vector<Answer> answers = m.ask({{1, 0}, {2, 0}, {3, 0}});
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(answers[i].kind, Kind::Done) << answers[i].text;
    EXPECT_EQ(answers[i].outputs[0].second, i + 1);
  }
}

TEST(Evaluator, StartsProgramsAnewThatAnswerOnePointEach) {
  Model m("read line; echo '{\"z\": 1}'");
  for (int i = 0; i < 3; ++i) EXPECT_EQ(m.ask({{1, 1}})[0].kind, Kind::Done);
  Model to_the_end("cat >/dev/null; echo '{\"z\": 1}'", 20, true);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(to_the_end.ask({{1, 1}})[0].kind, Kind::Done);
}

TEST(Evaluator, TellsHowItCrashed) {
  Model m("read line; echo 'no licence' >&2; exit 3");
  for (int i = 0; i < 2; ++i) {
    const Answer a = m.ask({{1, 1}})[0];
    EXPECT_EQ(a.kind, Kind::Crashed);
    EXPECT_NE(a.text.find("exit code 3: no licence"), std::string::npos) << a.text;
  }
  Model killed("read line; kill -SEGV $$");
  EXPECT_NE(killed.ask({{1, 1}})[0].text.find("signal 11"), std::string::npos);
  Model missing("/no/such/program");
  EXPECT_EQ(missing.ask({{1, 1}})[0].kind, Kind::Refused) << "it would fail at every point";
  EXPECT_NE(missing.ask({{1, 1}})[0].text.find("not found"), std::string::npos);
  Model recovers(shell(R"([ $x = 9.0 ] && exit 1; echo '{"z":1}')"));
  EXPECT_EQ(recovers.ask({{1, 1}})[0].kind, Kind::Done);
  EXPECT_EQ(recovers.ask({{9, 1}})[0].kind, Kind::Crashed);
  EXPECT_EQ(recovers.ask({{1, 1}})[0].kind, Kind::Done);
}

TEST(Evaluator, TakesALineThatBreaksOffForNoAnswer) {
  for (const char* text : {R"({"id":0,"outputs":{"z":1.)", R"({"outputs":{"z":1})", R"({"z": tr)", R"({"outc)", "{"}) {
    Model m(std::string("read line; printf '") + text + "'; exit 3");
    const Answer a = m.ask({{1, 1}})[0];
    EXPECT_EQ(a.kind, Kind::Crashed) << text << ": " << a.text;
    EXPECT_NE(a.text.find("exit code 3"), std::string::npos) << a.text;
  }
  // whole answers need no end of the line, and what is no answer stays that
  Model whole("read line; printf '{\"z\": 1}'");
  EXPECT_EQ(whole.ask({{1, 1}})[0].kind, Kind::Done);
  Model words("read line; printf 'done it'");
  EXPECT_EQ(words.ask({{1, 1}})[0].kind, Kind::Refused);
  Model ended("read line; echo '{\"z\": 1'");
  EXPECT_EQ(ended.ask({{1, 1}})[0].kind, Kind::Refused) << "a line that was ended is one";
}

TEST(Evaluator, AsksForNumbersOnly) {
  for (const char* text : {R"({"id":0,"y":1,"note":"text"})", R"({"outputs":{"y":"3"}})", R"({"y":[1]})", R"({"":1})",
                           R"({"y":1,"failed":0})", R"({"failed":[]})"}) {
    int id = 0;
    const Answer a = read_answer_line(text, "model", id);
    ASSERT_EQ(a.kind, Kind::Refused) << text;
    EXPECT_EQ(read_refusal(a.text).diagnostic.code, "E824");
  }
}

TEST(Evaluator, RefusesACommandThatCannotBeStarted) {
  for (const char* command : {"/nowhere/model --fast", "/etc/passwd"}) {
    Model m(command);
    const Answer a = m.ask({{1, 1}, {2, 2}})[1];
    ASSERT_EQ(a.kind, Kind::Refused) << a.text;
    const Refusal r = read_refusal(a.text);
    EXPECT_EQ(r.diagnostic.code, "E827");
    EXPECT_NE(r.diagnostic.message.find(command), std::string::npos);
    EXPECT_TRUE(r.diagnostic.where.file.empty());
  }
  // what has answered can be started
  Model late("read line; echo '{\"z\": 1}'; read line; exit 127");
  const std::vector<Answer> answers = late.ask({{1, 1}, {2, 1}});
  EXPECT_EQ(answers[0].kind, Kind::Done);
  EXPECT_EQ(answers[1].kind, Kind::Crashed);
}

TEST(Evaluator, GivesUpAfterItsTime) {
  Model m(shell(R"([ $x = 9.0 ] && sleep 100; echo '{"z":1}')"), 0.2);
  EXPECT_EQ(m.ask({{1, 1}})[0].kind, Kind::Done);
  const Answer a = m.ask({{9, 1}})[0];
  EXPECT_EQ(a.kind, Kind::Failed);
  EXPECT_EQ(a.text, "no answer within 0.2 s");
  EXPECT_EQ(m.ask({{1, 1}})[0].kind, Kind::Done);
  EXPECT_EQ(m.ask({{9, 1}, {9, 2}})[1].kind, Kind::Crashed) << "either may be to blame";
}

TEST(Evaluator, CountsNoLineThatSaysNothing) {
  const Folder folder;
  std::ofstream(folder / "slow.sh")
      << "while read -r line; do case $line in *'\"x\":9.0'*) while :; do echo; sleep 0.05; "
         "done;; *) echo; echo '{\"z\": 1}';; esac; done\n";
  Model slow("sh " + (folder / "slow.sh"), 0.5);
  EXPECT_EQ(slow.ask({{1, 1}})[0].kind, Kind::Done);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(slow.ask({{9, 1}})[0].text, "no answer within 0.5 s");
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  // nor a flood of them
  Model flood("read -r line; echo '{\"z\": 1}'; read -r line; yes ''", 0.3);
  EXPECT_EQ(flood.ask({{1, 1}})[0].kind, Kind::Done);
  EXPECT_EQ(flood.ask({{1, 1}})[0].text, "no answer within 0.3 s");
}

// What a failed run says is kept: it must not hang on how long a start took.
TEST(Evaluator, TellsNoTimeThatWasMeasured) {
  Model m(
      "sleep 0.3; while read -r line; do case $line in *'\"x\":9.0'*) sleep 100;; *) echo '{\"z\": 1}';; esac; done",
      0.2);
  EXPECT_EQ(m.ask({{9, 1}})[0].text, "no answer within 0.2 s") << "ten times as long";
  EXPECT_EQ(m.ask({{1, 1}})[0].kind, Kind::Done);
  EXPECT_EQ(m.ask({{9, 1}})[0].text, "no answer within 0.2 s");
  EXPECT_EQ(m.ask({{9, 1}})[0].text, "no answer within 0.2 s") << "behind a start that was measured";
}

TEST(Evaluator, SeesThatItEndedWhoeverHoldsItsOutput) {
  const auto start = std::chrono::steady_clock::now();
  // its child holds both streams open
  Model m("sleep 300 & read -r line; exit 3");
  const Answer a = m.ask({{1, 1}})[0];
  EXPECT_EQ(a.kind, Kind::Crashed);
  EXPECT_NE(a.text.find("exit code 3"), std::string::npos) << a.text;
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
  // a last word of what it started counts
  Model late("read -r line; (sleep 0.3; echo '{\"z\": 1}') & exit 0");
  EXPECT_EQ(late.ask({{1, 1}})[0].kind, Kind::Done);
}

TEST(Evaluator, GivesAProgramTimeToStart) {
  Model slow("sleep 0.5; while read -r line; do echo '{\"z\": 1}'; done", 0.2);
  EXPECT_EQ(slow.ask({{1, 1}})[0].kind, Kind::Done);
  Model again("sleep 0.5; read -r line; echo '{\"z\": 1}'", 0.2);  // a start for each point
  for (int i = 0; i < 3; ++i) EXPECT_EQ(again.ask({{1, 1}})[0].kind, Kind::Done) << i;
  Model ever("read -r line; case $line in *9*) sleep 0.6;; esac; echo '{\"z\": 1}'", 0);
  EXPECT_EQ(ever.ask({{1, 1}})[0].kind, Kind::Done);
  EXPECT_EQ(ever.ask({{9, 1}})[0].kind, Kind::Done) << "no time-out at all";
}

TEST(Evaluator, RefusesAProgramThatNeverAnswers) {
  Model dead("echo 'no licence' >&2; exit 1");
  for (int i = 1; i < 10; ++i) EXPECT_EQ(dead.ask({{1, 1}})[0].kind, Kind::Crashed) << i;
  const Answer a = dead.ask({{1, 1}})[0];
  ASSERT_EQ(a.kind, Kind::Refused);
  EXPECT_EQ(read_refusal(a.text).diagnostic.code, "E828");
  EXPECT_NE(read_refusal(a.text).diagnostic.message.find("10 times"), std::string::npos);
  EXPECT_NE(read_refusal(a.text).diagnostic.message.find("no licence"), std::string::npos);
  Model silent("read line; sleep 100", 0.02);
  for (int i = 1; i < 3; ++i) EXPECT_EQ(silent.ask({{1, 1}})[0].kind, Kind::Failed) << i;
  const Answer b = silent.ask({{1, 1}})[0];
  ASSERT_EQ(b.kind, Kind::Refused);
  EXPECT_NE(read_refusal(b.text).diagnostic.message.find("no answer within 0.2 s"), std::string::npos) << b.text;
  // what has answered once is there
  Model once(shell(R"([ $x = 9.0 ] && exit 1; echo '{"z":1}')"));
  EXPECT_EQ(once.ask({{1, 1}})[0].kind, Kind::Done);
  for (int i = 0; i < 12; ++i) EXPECT_EQ(once.ask({{9, 1}})[0].kind, Kind::Crashed) << i;
}

TEST(Evaluator, RefusesAKeyThatIsGivenTwice) {
  const auto column_of = [](const std::string& line) {
    int id = 0;
    const Answer a = read_answer_line(line, "model", id);
    EXPECT_EQ(a.kind, Kind::Refused) << line;
    const Refusal r = read_refusal(a.text);
    EXPECT_EQ(r.diagnostic.code, "E824");
    EXPECT_NE(r.diagnostic.message.find("is given twice"), std::string::npos) << r.diagnostic.message;
    return r.diagnostic.where.column;
  };
  EXPECT_EQ(column_of(R"({"id":0,"outputs":{"z":1,"z":5,"w":1}})"), 26);
  EXPECT_EQ(column_of(R"({"id":0,"outputs":{"id":1,"z":5}, "id" : 1})"), 35);
  EXPECT_EQ(column_of(R"({"outcome":"z","z":1,"z":2})"), 22);
  int id = 0;
  EXPECT_EQ(read_answer_line(R"({"id":0,"outputs":{"id":1,"z":5}})", "model", id).kind, Kind::Done);
}

TEST(Evaluator, StopsWhenCancelled) {
  Model m("read line; sleep 100");
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    m.cancel = true;
  });
  EXPECT_EQ(m.ask({{1, 1}})[0].kind, Kind::Cancelled);
  later.join();
}

TEST(Evaluator, ReadsFormsOfAnswers) {
  int id = 0;
  const auto read = [&id](const std::string& line) { return read_answer_line(line, "model", id); };
  EXPECT_EQ(read(R"({"a": 1, "b": 2.5, "id": 4})").outputs.size(), 2u);
  EXPECT_EQ(id, 4);
  EXPECT_EQ(read(R"({"outputs": {"a": 1}, "trajectory": [1, null, 3]})").trajectory.size(), 3u);
  EXPECT_EQ(read(R"({"outcome": 2})").outcome, "2");
  EXPECT_EQ(read(R"({"outcome": true, "outputs": {}})").outcome, "true");
  EXPECT_EQ(read(R"({"outputs": {"a": 1}, "outcome": null, "trajectory": null})").kind, Kind::Done) << "left out";
  EXPECT_EQ(read(R"({"outputs": {"a": 1}, "outcome": null})").outcome, "");
  EXPECT_EQ(read(R"({"failed": "no balance"})").text, "no balance");
  EXPECT_EQ(read(R"({"failed": true})").kind, Kind::Failed);
  EXPECT_EQ(read(R"({"failed": false, "z": 1})").kind, Kind::Done);
  EXPECT_EQ(read(R"({"failed": null, "z": 1})").kind, Kind::Done) << "it did not";
  EXPECT_EQ(read(R"({"failed": null, "z": 1})").outputs.size(), 1u);
  EXPECT_EQ(read(R"({"failed": ""})").kind, Kind::Failed);
  EXPECT_EQ(read(R"({"outputs": {"a": null}})").kind, Kind::Failed);
  EXPECT_EQ(read(R"({"outputs": {"a": null}})").text, "a is not finite");
  EXPECT_EQ(read(R"({"outputs": {"a": -1e308}})").text, "a is larger than 4.49e+307");
}

TEST(Evaluator, PointsAtWhatItCannotUnderstand) {
  const auto read = [](const std::string& line) {
    int id = 0;
    const Answer a = read_answer_line(line, "model", id);
    EXPECT_EQ(a.kind, Kind::Refused) << line;
    return read_refusal(a.text);
  };
  const Refusal broken = read(R"({"ü": 1, oops})");
  EXPECT_EQ(broken.diagnostic.code, "E824");
  EXPECT_EQ(broken.diagnostic.where.column, 10);
  EXPECT_EQ(broken.line, R"({"ü": 1, oops})");
  EXPECT_NE(broken.diagnostic.where.file.find("model"), std::string::npos);
  EXPECT_EQ(read(R"({"outputs": {"a": 1, "b": "tall"}})").diagnostic.where.column, 22);
  const Refusal misspelt = read(R"({"outputs": {"a": 1}, "outcom": "tilt"})");
  EXPECT_EQ(misspelt.diagnostic.message, "\"outcom\" means nothing beside outputs");
  EXPECT_EQ(misspelt.diagnostic.where.column, 23);
  EXPECT_EQ(read("3").diagnostic.message, "a JSON object is wanted");
  EXPECT_EQ(read("{}").diagnostic.message, "there are neither outputs nor an outcome");
  read(R"({"outcome": [1]})");
  EXPECT_EQ(read(R"({"z": 1, "outcome": ""})").diagnostic.message, "outcome: the name is empty");
  EXPECT_EQ(read(R"({"z": 1, "outcome": ""})").diagnostic.where.column, 10);
  read(R"({"outcome": ""})");
  read(R"({"trajectory": 1, "z": 1})");
  read(R"({"id": "a", "z": 1})");
  read("\xff\xfe");
  Model stranger("read line; echo '{\"id\": 5, \"z\": 1}'");
  EXPECT_EQ(stranger.ask({{1, 1}})[0].kind, Kind::Refused);
}

TEST(Evaluator, RefusesWordsThatAreNoNumbers) {
  for (const char* word : {"NaN", "nan", "-Infinity", "Infinity", "inf", "-inf"}) {
    int id = 0;
    const Answer a = read_answer_line(std::string("{\"outputs\": {\"z\": ") + word + "}}", "model", id);
    ASSERT_EQ(a.kind, Kind::Refused) << word;
    const Refusal r = read_refusal(a.text);
    EXPECT_NE(r.diagnostic.message.find("is no number in JSON"), std::string::npos) << r.diagnostic.message;
    EXPECT_NE(r.diagnostic.help.find("null"), std::string::npos);
    EXPECT_GE(r.diagnostic.where.column, 19) << word;
  }
}

TEST(Evaluator, RefusesNumbersBeyondItsRange) {
  int id = 0;
  for (const char* line : {R"({"z": 1e999})", R"({"id": 1e999, "z": 1})", R"({"id": 18446744073709551615, "z": 1})",
                           R"({"id": 4294967296, "z": 1})", R"({"id": -1, "z": 1})"})
    EXPECT_EQ(read_answer_line(line, "model", id).kind, Kind::Refused) << line;
  EXPECT_EQ(id, 0);
  EXPECT_EQ(read_answer_line(R"({"z": 1.7976931348623157e308})", "model", id).outputs[0].second,
            1.7976931348623157e308);
}

TEST(Evaluator, PointsAtANumberBeyondItsRange) {
  int id = 0;
  const Answer a = read_answer_line(R"({"outputs": {"z": 1, "big": -1e999}})", "model", id);
  ASSERT_EQ(a.kind, Kind::Refused);
  EXPECT_EQ(read_refusal(a.text).diagnostic.where.column, 29);
}

TEST(Evaluator, RefusesATrajectoryOfAnotherLength) {
  const auto make = [](std::vector<double> trajectory) {
    Answer a{Kind::Done, {{"z", 1}}, "", std::move(trajectory), "", 0};
    a.line = R"({"z": 1, "trajectory": [1, 2, 3]})";
    return a;
  };
  const AnswerForm two{{"z"}, 2}, none{{"z"}, 0};
  EXPECT_EQ(compare_form(make({1, 2}), two).kind, Kind::Done);
  EXPECT_EQ(compare_form(make({}), two).kind, Kind::Done) << "it may be left out";
  EXPECT_EQ(compare_form(make({1, 2, 3}), none).kind, Kind::Done);
  const Answer refused = compare_form(make({1, 2, 3}), two);
  ASSERT_EQ(refused.kind, Kind::Refused);
  const Diagnostic d = read_refusal(refused.text).diagnostic;
  EXPECT_EQ(d.code, "E823");
  EXPECT_EQ(d.where.column, 10);
  EXPECT_EQ(d.message, "the model gave a trajectory of the length 3 at this point and of the length 2 at others");
}

TEST(Evaluator, NeverTakesADoubledAnswerForAnotherPoint) {
  Model m(shell(R"(echo "{\"id\":$id,\"z\":$x}"; echo "{\"id\":$id,\"z\":$x}")"));
  ASSERT_EQ(m.ask({{1, 0}})[0].kind, Kind::Done);
  // the second line is there before the next point is asked for, or comes behind it
  const Answer a = m.ask({{2, 0}})[0];
  ASSERT_EQ(a.kind, Kind::Refused) << "not " << a.outputs[0].second;
  Model twice(shell(R"(echo "{\"id\":$id,\"z\":$x}"; echo "{\"id\":$id,\"z\":$x}")"));
  const std::vector<Answer> both = twice.ask({{1, 0}, {2, 0}});
  EXPECT_EQ(both[0].kind, Kind::Done);
  EXPECT_EQ(both[1].kind, Kind::Refused);
}

TEST(Evaluator, RefusesALineThatIsTooLong) {
  // without an end, and with one
  for (const char* command :
       {"read line; yes | tr -d '\\n'", "read line; yes | head -c 36000000 | tr -d '\\n'; echo"}) {
    Model m(command);
    const Answer a = m.ask({{1, 1}})[0];
    ASSERT_EQ(a.kind, Kind::Refused);
    const Refusal r = read_refusal(a.text);
    EXPECT_EQ(r.diagnostic.message, "the line is longer than 16 MB");
    EXPECT_EQ(r.line, std::string(100, 'y'));
  }
}

TEST(Evaluator, TellsWhenItClosedItsOutputAndWentOn) {
  Model m("read line; exec >&-; sleep 100");
  const Answer a = m.ask({{1, 1}})[0];
  EXPECT_EQ(a.kind, Kind::Crashed);
  EXPECT_NE(a.text.find("closed its output and went on"), std::string::npos) << a.text;
  // nor does the shell that started it hold it open
  const Folder folder;
  std::ofstream(folder / "model.sh") << "read -r line\nexec >&-\nexec sleep 100\n";
  Model script("sh " + (folder / "model.sh"));
  const Answer b = script.ask({{1, 1}})[0];
  EXPECT_EQ(b.kind, Kind::Crashed);
  EXPECT_NE(b.text.find("closed its output and went on"), std::string::npos) << b.text;
}

TEST(Evaluator, WritesToAProgramThatDoesNotRead) {
  Model m("exec <&-; sleep 100", 0.5);
  // more than a pipe holds
  const std::vector<Answer> answers = m.ask(std::vector<Point>(5000, Point{1, 1}));
  EXPECT_EQ(answers.front().kind, Kind::Crashed) << "several points: nobody knows which one hangs";
  EXPECT_EQ(answers.back().kind, Kind::Crashed);
}

}  // namespace
}  // namespace topple::study
