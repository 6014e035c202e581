// Starting, answering, stopping; and what the command line says without a server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/integration/answers.h"
#include "vantage/v1/session.pb.h"

namespace vantage::integration {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Lifecycle, ServesAndEndsOnSigterm) {
  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  const Finished health = Vantage(server, {"health"});
  EXPECT_EQ(health.exit_code, 0) << health.error;
  EXPECT_EQ(health.out, "serving\n");
  EXPECT_EQ(Vantage(server, {"health", "vantage.v1.PlanService"}).exit_code, 0);
  EXPECT_EQ(Vantage(server, {"health", "no.such.Service"}).exit_code, 3);
  EXPECT_EQ(server.Stop(SIGTERM), 0) << server.Log();
}

TEST(Lifecycle, EndsOnSigtermWhileWatched) {
  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  ASSERT_EQ(Vantage(server, {"session", "create", "job"}).exit_code, 0);
  // One event is there; the watch returns after it.
  const Finished watched = Vantage(server, {"watch", "job", "--count", "1"});
  EXPECT_EQ(watched.exit_code, 0) << watched.error;
  EXPECT_THAT(watched.out, HasSubstr("session created"));
  EXPECT_EQ(server.Stop(SIGTERM), 0) << server.Log();
}

// What an operator does about a session that is damaged, and about a folder that is.
TEST(Operator, SavesASessionAndTakesItOut) {
  const ScratchFolder scratch;
  const std::string data = scratch.File("data");
  const std::string saved = scratch.File("saved");
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), VANTAGED_BINARY);
    arguments.insert(arguments.end(), {"--data", data});
    return RunProgram(arguments);
  };
  {
    ServerProcess server(data);
    ASSERT_EQ(Vantage(server, {"session", "create", "museum"}).exit_code, 0);
    ASSERT_EQ(Vantage(server, {"session", "create", "other"}).exit_code, 0);
    // Beside the server, what there is can be saved, and nothing can be taken out.
    const Finished beside = run({"salvage", "museum", saved});
    EXPECT_EQ(beside.exit_code, 0) << beside.error;
    EXPECT_THAT(beside.out, HasSubstr("1 log entries"));
    const Finished refused = run({"salvage", "museum", scratch.File("again"), "--remove"});
    EXPECT_NE(refused.exit_code, 0);
    EXPECT_THAT(refused.error, HasSubstr("another server uses the data"));
    EXPECT_EQ(Vantage(server, {"session", "show", "museum"}).exit_code, 0);
    EXPECT_EQ(server.Stop(SIGTERM), 0) << server.Log();
  }
  EXPECT_NE(run({"salvage", "museum", saved}).exit_code, 0) << "written over";
  EXPECT_NE(run({"salvage", "nobody", scratch.File("none")}).exit_code, 0);
  const Finished removed = run({"salvage", "museum", scratch.File("last"), "--remove"});
  EXPECT_EQ(removed.exit_code, 0) << removed.error;
  ServerProcess server(data);
  EXPECT_EQ(Vantage(server, {"session", "show", "museum"}).exit_code, 3);
  EXPECT_EQ(Vantage(server, {"session", "show", "other"}).exit_code, 0);
}

TEST(Lifecycle, SessionsComeAndGo) {
  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  const auto created = Answer<v1::Session>(
      Vantage(server, {"session", "create", "flat", "--name", "Flat, 3rd floor", "--density",
                       "1600", "--set", "planning_config.max_viewpoint_height_m=1.9", "--json"}));
  EXPECT_EQ(created.name(), "sessions/flat");
  EXPECT_EQ(created.planning_config().required_density_per_m2(), 1600);
  EXPECT_EQ(created.planning_config().max_viewpoint_height_m(), 1.9);
  EXPECT_EQ(created.planning_config().min_viewpoint_height_m(), 1.0);  // the default, filled in
  EXPECT_EQ(created.scanner_models_size(), 1);

  const Finished updated = Vantage(server, {"session", "update", "flat", "--set",
                                            "planning_config.required_density_per_m2=900"});
  EXPECT_EQ(updated.exit_code, 0) << updated.error;
  const auto shown = Answer<v1::Session>(Vantage(server, {"session", "show", "flat", "--json"}));
  EXPECT_EQ(shown.planning_config().required_density_per_m2(), 900);
  EXPECT_EQ(shown.planning_config().max_viewpoint_height_m(), 1.9);

  EXPECT_THAT(Vantage(server, {"session", "list"}).out, HasSubstr("Flat, 3rd floor"));
  EXPECT_EQ(Vantage(server, {"session", "delete", "flat"}).exit_code, 0);
  EXPECT_THAT(Vantage(server, {"session", "list"}).out, HasSubstr("no sessions"));
  EXPECT_EQ(Vantage(server, {"session", "show", "flat"}).exit_code, 3);
}

TEST(CommandLine, WithoutServerNamesCauseAndFix) {
  // Port 1 of loopback: nothing of ours listens there.
  const Finished finished =
      RunProgram({VANTAGE_BINARY, "--server", "127.0.0.1:1", "session", "list"});
  EXPECT_EQ(finished.exit_code, 4);
  EXPECT_EQ(finished.out, "");
  EXPECT_THAT(finished.error, HasSubstr("cannot reach the server at 127.0.0.1:1"));
  EXPECT_THAT(finished.error, HasSubstr("--server"));
}

TEST(CommandLine, EveryCommandExplainsItselfWithAnExample) {
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"session", "create"},
                                             {"session", "list"},
                                             {"session", "show"},
                                             {"session", "update"},
                                             {"session", "delete"},
                                             {"scan", "push"},
                                             {"scan", "list"},
                                             {"scan", "show"},
                                             {"scan", "accept"},
                                             {"scan", "withdraw"},
                                             {"scan", "set-pose"},
                                             {"plan"},
                                             {"evaluate"},
                                             {"reject"},
                                             {"coverage"},
                                             {"watch"},
                                             {"export"},
                                             {"report"},
                                             {"picture"},
                                             {"simulate"},
                                             {"health"}}) {
    std::vector<std::string> arguments = {VANTAGE_BINARY};
    arguments.insert(arguments.end(), command.begin(), command.end());
    arguments.push_back("--help");
    const Finished finished = RunProgram(arguments);
    EXPECT_EQ(finished.exit_code, 0) << command.back();
    EXPECT_THAT(finished.out, HasSubstr("Examples:\n  vantage " + command.front()));
    EXPECT_THAT(finished.out, Not(HasSubstr("\033")));
  }
}

TEST(CommandLine, NonsenseIsAUsageError) {
  EXPECT_EQ(RunProgram({VANTAGE_BINARY}).exit_code, 2);
  EXPECT_EQ(RunProgram({VANTAGE_BINARY, "dance"}).exit_code, 2);
  EXPECT_EQ(RunProgram({VANTAGE_BINARY, "plan"}).exit_code, 2);
  EXPECT_EQ(RunProgram({VANTAGE_BINARY, "evaluate", "flat", "1,2"}).exit_code, 2);
}

}  // namespace
}  // namespace vantage::integration
