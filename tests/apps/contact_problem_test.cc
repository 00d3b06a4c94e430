// `counterpoint contact-problem`: exit codes, the keys of its report, messages about wrong files.
#include <gtest/gtest.h>

#include <string>

#include "apps/command.h"
#include "support/paths.h"

namespace counterpoint::contact_problem_test {
namespace {

using test::CommandFolder;
using test::CommandResult;
namespace fs = std::filesystem;

class ContactProblem : public testing::Test {
 protected:
  // A mass of 1 kg on the ground slides at 1 m/s and is pushed down by 2 N s; mu = 0.5.
  ContactProblem() {
    write("q_mu.csv", "q_n,q_t1,q_t2,mu\n-2,1,0,0.5\n");
    write("W.csv", "row,col,value\n0,0,1\n1,1,1\n2,2,1\n");
  }
  void write(const std::string& name, const std::string& content) const {
    fs::create_directories(folder_.path("p"));
    folder_.write("p/" + name, content);
  }

  CommandFolder folder_{std::string("contact_problem_") +
                        testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(ContactProblem, ReportsBothFrictionModels) {
  const CommandResult result = folder_.run("contact-problem {}/p --json {}/r.json");
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_NE(result.output.find("coulomb"), std::string::npos);
  const nlohmann::json report = folder_.json("r.json");
  EXPECT_EQ(report["status"], "ok");
  ASSERT_EQ(report["problems"].size(), 2u);
  for (const auto& problem : report["problems"]) {
    for (const char* key : {"name", "contacts", "friction_model", "status", "iterations", "time_ms",
                            "rank", "asymmetry", "primal", "dual", "complementarity",
                            "dual_as_given", "complementarity_as_given", "inverse_error"}) {
      EXPECT_TRUE(problem.contains(key)) << key;
    }
    EXPECT_EQ(problem["name"], "p");
    EXPECT_EQ(problem["contacts"], 1);
    EXPECT_EQ(problem["rank"], 3);
    EXPECT_EQ(problem["asymmetry"], 0.0);
    constexpr double kCompliance = 1e-8;  // the default; bounds the residuals for impulses of 2 N s
    EXPECT_LE(problem["dual"], 10 * kCompliance);
    EXPECT_LE(problem["complementarity"], 10 * kCompliance);
    // Round-off of v over the compliance: a few units of 1e-16 / 1e-8.
    EXPECT_LE(problem["inverse_error"], 1e-7);
  }
  EXPECT_EQ(report["problems"][0]["friction_model"], "convex");
  EXPECT_EQ(report["problems"][1]["friction_model"], "coulomb");
}

TEST_F(ContactProblem, OneFrictionModelIfAsked) {
  const CommandResult result = folder_.run("contact-problem {}/p --friction coulomb --json -");
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json report =
      nlohmann::json::parse(result.output);  // throws if there is more text
  ASSERT_EQ(report["problems"].size(), 1u);
  EXPECT_EQ(report["problems"][0]["friction_model"], "coulomb");
  folder_.refuse("contact-problem {}/p --friction none", "--friction");
}

TEST_F(ContactProblem, AFolderOfProblemsIsSolvedByName) {
  fs::copy(folder_.path("p"), folder_.path("a"));
  const nlohmann::json report = folder_.report("contact-problem {} --friction convex");
  ASSERT_EQ(report["problems"].size(), 2u);
  EXPECT_EQ(report["problems"][0]["name"], "a");
  EXPECT_EQ(report["problems"][1]["name"], "p");
}

TEST_F(ContactProblem, NotesWhereTheMatrixIsNotSymmetric) {
  write("q_mu.csv", "q_n,q_t1,q_t2,mu\n-2,0.5,0,0.5\n");  // sticks with r of about (2, -0.5, 0)
  write("W.csv", "row,col,value\n0,0,1\n1,1,1\n2,2,1\n0,1,0.02\n1,0,0.01\n");
  const nlohmann::json problem = folder_.report("contact-problem {}/p")["problems"][0];
  EXPECT_NEAR(problem["asymmetry"], 0.01, 1e-15);
  EXPECT_LT(problem["dual"], 1e-6);
  // W r + q is off by 0.005 r, 0.01 in the tangential direction, relative to |q| = 2.
  EXPECT_GT(problem["dual_as_given"], 1e-3);
}

TEST_F(ContactProblem, FailureHasItsExitCode) {
  const CommandResult result =
      folder_.run("contact-problem {}/p --max-iterations 0 --friction convex --json {}/r.json");
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(folder_.json("r.json")["status"], "failed");
  EXPECT_EQ(folder_.json("r.json")["problems"][0]["status"], "iteration limit");
}

TEST_F(ContactProblem, SaysWhatIsWrongWithTheContacts) {
  folder_.refuse("contact-problem {}/none", "there is no such folder");
  folder_.refuse("contact-problem ", "folder");
  write("q_mu.csv", "q_n,q_t1,q_t2,mu\n-2,1,0,-0.5\n");
  folder_.refuse("contact-problem {}/p", "q_mu.csv:2: mu = -0.5");
  write("q_mu.csv", "q_n,q_t1,q_t2,mu\n-2,1,0\n");
  folder_.refuse("contact-problem {}/p", "q_mu.csv:2");
  write("q_mu.csv", "q_n,q_t1,q_t2,mu\n-2,1,0,0.5,7\n");
  folder_.refuse("contact-problem {}/p", "q_mu.csv:2");
  write("q_mu.csv", "q_n,q_t1,q_t2,mu\n-2,nan,0,0.5\n");
  folder_.refuse("contact-problem {}/p", "q_mu.csv:2");
  write("q_mu.csv", "q_n,q_t1,q_t2,mu\n-2,,0,0.5\n");
  folder_.refuse("contact-problem {}/p", "q_mu.csv:2");
  write("q_mu.csv", "q_n,q_t1,q_t2,mu\n-2,1,0,much\n");
  folder_.refuse("contact-problem {}/p", "q_mu.csv:2");
  write("q_mu.csv", "q_n,q_t1,q_t2\n-2,1,0\n");
  folder_.refuse("contact-problem {}/p", "'mu'");
  write("q_mu.csv", "q_n,q_t1,q_t2,mu\n");
  folder_.refuse("contact-problem {}/p", "holds no contact");
  fs::remove(folder_.path("p/q_mu.csv"));
  folder_.refuse("contact-problem {}/p", "expected a folder with W.csv");
}

TEST_F(ContactProblem, SaysWhatIsWrongWithTheMatrix) {
  write("W.csv", "row,col,value\n0,0,1\n3,3,1\n");
  folder_.refuse("contact-problem {}/p", "W.csv:3: index 3; expected a whole number from 0 to 2");
  write("W.csv", "row,col,value\n0,-1,1\n");
  folder_.refuse("contact-problem {}/p", "W.csv:2: index -1");
  write("W.csv", "row,col,value\n0,0.5,1\n");
  folder_.refuse("contact-problem {}/p", "W.csv:2: index 0.5");
  write("W.csv", "row,col,value\n0,0\n");
  folder_.refuse("contact-problem {}/p", "W.csv:2");
  write("W.csv", "row,col,value\n0,0,inf\n");
  folder_.refuse("contact-problem {}/p", "W.csv:2");
  write("W.csv", "row,col,value\n0,0,1\n0,0,1\n");
  folder_.refuse("contact-problem {}/p", "W.csv:3: entry (0, 0) is given twice");
  write("W.csv", "row,col,value\n0,0,-1\n");
  folder_.refuse("contact-problem {}/p", "diagonal entry 0 is -1");
  write("W.csv", "a,b,c\n0,0,1\n");
  folder_.refuse("contact-problem {}/p", "'row'");
  fs::remove(folder_.path("p/W.csv"));
  folder_.refuse("contact-problem {}/p", "W.csv: there is no such file");
}

TEST_F(ContactProblem, SolvesTheRecordedProblems) {
  const fs::path recorded = fs::path(test::shared_data()) / "contact_problems";
  if (!fs::exists(recorded)) GTEST_SKIP() << recorded << " is missing: not tried";
  const nlohmann::json report =
      folder_.report("contact-problem '" + recorded.string() + "' --friction convex");
  EXPECT_GE(report["problems"].size(), 11u);
  for (const auto& problem : report["problems"]) {
    constexpr double kSolved = 1e-6;  // required tolerance
    EXPECT_LT(problem["primal"], kSolved) << problem["name"];
    EXPECT_LT(problem["dual"], kSolved) << problem["name"];
    EXPECT_LT(problem["complementarity"], kSolved) << problem["name"];
  }
}

}  // namespace
}  // namespace counterpoint::contact_problem_test
