// The viewer through its protocol, as a page speaks it; and what is no page.
#include <gtest/gtest.h>
#include <httplib.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/support/run_program.h"

namespace nephele {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

/// A viewer that runs for as long as this.
class Viewer {
 public:
  explicit Viewer(std::vector<std::string> arguments) {
    int ends[2];
    if (pipe(ends) != 0) std::abort();
    arguments.insert(arguments.begin(), {"nephele", "look"});
    arguments.insert(arguments.end(), {"--no-browser", "--port", "8300"});
    std::vector<char*> words;
    const std::string program = test::programPath();
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    process_ = fork();
    if (process_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      close(ends[0]);
      execv(program.c_str(), words.data());
      _exit(99);
    }
    close(ends[1]);
    char c;
    while (read(ends[0], &c, 1) == 1 && c != '\n') address_ += c;
    close(ends[0]);
    const std::size_t port = address_.find(':', 7), path = address_.find('/', port);
    port_ = std::stoi(address_.substr(port + 1));
    base_ = address_.substr(path);
  }
  ~Viewer() { end(); }

  int port() const { return port_; }
  const std::string& base() const { return base_; }
  httplib::Client client() const { return httplib::Client("127.0.0.1", port_); }
  /// "" while it runs, else how it ended.
  std::string ending() {
    int status = 0;
    if (waitpid(process_, &status, WNOHANG) == 0) return "";
    process_ = -1;
    return WIFEXITED(status) ? "exit " + std::to_string(WEXITSTATUS(status))
                             : "signal " + std::to_string(WTERMSIG(status));
  }

  /// Exit code after a signal, and the seconds that it took.
  std::pair<int, double> end() {
    if (process_ <= 0) return {0, 0};
    const auto start = Clock::now();
    kill(process_, SIGTERM);
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = -1;
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
            std::chrono::duration<double>(Clock::now() - start).count()};
  }

  httplib::Result post(const std::string& name, const Json& body) const {
    return client().Post((base_ + name).c_str(), body.dump(), "application/json");
  }

  /// Reads the stream of a page until `done` is true of a message, after `ask` once it is open.
  std::vector<Json> messages(const std::string& page, const std::function<void()>& ask,
                             const std::function<bool(const Json&)>& done) const {
    std::vector<Json> all;
    std::string bytes;
    bool hasAsked = false;
    httplib::Client reader = client();
    reader.set_read_timeout(60);
    std::thread asking;
    reader.Get((base_ + "stream?page=" + page).c_str(),
               [&](const httplib::Response&) {
                 asking = std::thread(ask);
                 hasAsked = true;
                 return true;
               },
               [&](const char* data, std::size_t size) {
                 bytes.append(data, size);
                 while (bytes.size() >= 8) {
                   std::uint32_t text, payload;
                   std::memcpy(&text, bytes.data(), 4);
                   std::memcpy(&payload, bytes.data() + 4, 4);
                   if (bytes.size() < 8 + std::size_t(text) + payload) break;
                   if (text > 0) {
                     Json message = Json::parse(bytes.substr(8, text));
                     message["payload"] =
                         payload > 1 ? int(std::uint8_t(bytes[8 + text])) << 8 | std::uint8_t(bytes[9 + text])
                                     : 0;
                     all.push_back(message);
                   }
                   bytes.erase(0, 8 + std::size_t(text) + payload);
                   if (!all.empty() && done(all.back())) return false;
                 }
                 return true;
               });
    if (hasAsked) asking.join();
    return all;
  }

 private:
  pid_t process_ = -1;
  std::string address_, base_;
  int port_ = 0;
};

std::vector<std::string> small() {
  return {test::ownData("data/cloud_base.obj"), "--resolution", "40", "--layers", "2"};
}

Json settings(int revision, const Json& cloud = Json::object(), const Json& render = Json::object()) {
  return {{"page", "a"},
          {"revision", revision},
          {"size", {64, 36}},
          {"settings", {{"cloud", cloud}, {"render", render}}}};
}

bool isFinal(const Json& message) {
  return message["type"] == "error" || (message["type"] == "picture" && message["final"] == true);
}

TEST(LookVerb, ShowsACoarsePictureAndThenAFinerOne) {
  const Viewer viewer(small());
  const auto page = viewer.client().Get(viewer.base().c_str());
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_NE(page->body.find("Nephele"), std::string::npos);
  const std::vector<Json> all = viewer.messages(
      "a", [&] { EXPECT_EQ(viewer.post("settings", settings(1))->status, 200); }, isFinal);
  std::vector<Json> pictures;
  for (const Json& message : all)
    if (message["type"] == "picture") pictures.push_back(message);
  ASSERT_GE(pictures.size(), 1u);
  const Json& last = pictures.back();
  EXPECT_EQ(last["width"], 64);
  EXPECT_EQ(last["height"], 36);
  EXPECT_EQ(last["revision"], 1);
  // Of a JPEG file, its first two bytes.
  for (const Json& picture : pictures) EXPECT_EQ(picture["payload"], 0xffd8);
  EXPECT_TRUE(pictures.front()["final"] == false || pictures.size() == 1);
  EXPECT_NEAR(last["camera"]["fov"].get<double>(), 35, 1e-3);
}

TEST(LookVerb, SaysWhatTheCommandLineSaysOfAWrongValue) {
  const Viewer viewer(small());
  const auto answer = viewer.post("settings", settings(1, {{"amplitude", "-3%"}}));
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 422);
  const Json error = Json::parse(answer->body)["errors"][0];
  EXPECT_EQ(error["option"], "amplitude");
  EXPECT_EQ(error["verb"], "cloud");
  const auto typed = test::runProgram("cloud " + test::ownData("data/cloud_base.obj") +
                                      " -o /tmp/unused.vdb --amplitude=-3%");
  EXPECT_EQ(typed.exitCode, 2);
  EXPECT_NE(typed.errors.find(error["message"].get<std::string>()), std::string::npos)
      << error << typed.errors;
  EXPECT_EQ(viewer.post("settings", settings(1, {{"amplitud", "3%"}}))->status, 422);
  EXPECT_EQ(viewer.post("settings", settings(1, {}, {{"sun", Json::array({"90,x"})}}))->status, 422);
  EXPECT_EQ(viewer.post("settings", {{"page", "a"}, {"size", {64, 100000}}})->status, 422);
}

TEST(LookVerb, IsForItsOwnPageOnly) {
  Viewer viewer(small());
  httplib::Client client = viewer.client();
  EXPECT_EQ(client.Get("/")->status, 404);
  EXPECT_EQ(client.Get("/abcdefghijklmnopqrstuv/controls")->status, 404);
  EXPECT_EQ(client.Get((viewer.base() + "../../etc/passwd").c_str())->status, 404);
  EXPECT_EQ(client.Get((viewer.base() + "%2e%2e/secret").c_str())->status, 404);
  EXPECT_EQ(client.Get(viewer.base().c_str(), {{"Host", "evil.example"}})->status, 403);
  EXPECT_EQ(client
                .Post((viewer.base() + "settings").c_str(), {{"Origin", "http://evil.example"}}, "{}",
                      "application/json")
                ->status,
            403);
  EXPECT_EQ(client.Post((viewer.base() + "settings").c_str(), "nonsense", "text/plain")->status, 422);
  EXPECT_EQ(client.Post((viewer.base() + "settings").c_str(), "{\"page\": 7}", "application/json")->status,
            400);
  EXPECT_EQ(client.Post((viewer.base() + "settings").c_str(), std::string(2 << 20, 'x'), "application/json")
                ->status,
            413);
  EXPECT_EQ(viewer.ending(), "");
}

TEST(LookVerb, LetsNoPageWriteByAnOption) {
  const test::TemporaryFolder folder;
  const Viewer viewer(small());
  const Json ofRender[]{{{"deep", folder.file("x.exr")}},
                        {{"write-deep-shadow", Json::array({folder.file("x.exr")})}},
                        {{"stats", folder.file("x.json")}},
                        {{"display-server", "127.0.0.1"}},
                        {{"wedge", Json::array({"seed=1-3"})}}};
  for (const Json& settingsOfRender : ofRender) {
    EXPECT_EQ(viewer.post("settings", settings(1, Json::object(), settingsOfRender))->status, 422)
        << settingsOfRender;
    Json job = settings(1, Json::object(), settingsOfRender);
    job.update({{"what", "exr"}, {"file", "y.exr"}});
    EXPECT_EQ(viewer.post("job", job)->status, 422) << settingsOfRender;
  }
  EXPECT_EQ(viewer.post("settings", settings(1, {{"cache", folder.file("")}}))->status, 422);
  EXPECT_EQ(viewer.post("settings", settings(1, {{"output", folder.file("x.vdb")}}))->status, 422);
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(LookVerb, OutlivesWhatIsNoBrowser) {
  Viewer viewer(small());
  for (const std::string& garbage : {std::string("\0\1\2\3\xff\xfe", 6), std::string("GET "),
                                     std::string(100000, 'A'), std::string("GET / HTTP/1.1\r\nHost: ")}) {
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(std::uint16_t(viewer.port()));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(connect(socket, reinterpret_cast<sockaddr*>(&to), sizeof(to)), 0);
    static_cast<void>(send(socket, garbage.data(), garbage.size(), MSG_NOSIGNAL));
    close(socket);
  }
  EXPECT_EQ(viewer.client().Get((viewer.base() + "controls").c_str())->status, 200);
}

TEST(LookVerb, TellsItsControlsFromTheTableOfOptions) {
  const Viewer viewer(small());
  const Json controls = Json::parse(viewer.client().Get((viewer.base() + "controls").c_str())->body);
  EXPECT_EQ(controls["settings"]["cloud"]["resolution"], "40");
  std::map<std::string, Json> byName;
  for (const Json& group : controls["groups"])
    for (const Json& control : group["controls"])
      byName[control["verb"].get<std::string>() + "." + control["name"].get<std::string>()] = control;
  EXPECT_GT(byName.size(), 60u);
  EXPECT_EQ(byName.at("cloud.amplitude")["default"], "2.5%");
  EXPECT_EQ(byName.at("cloud.amplitude")["is_field"], true);
  EXPECT_EQ(byName.at("cloud.renormalise")["choices"], Json({"off", "sweep", "rebuild"}));
  EXPECT_EQ(byName.at("render.exposure")["type"], "number");
  EXPECT_EQ(byName.at("render.sun")["repeats"], true);
  EXPECT_EQ(byName.count("cloud.output"), 0u);
  EXPECT_EQ(byName.count("render.deep"), 0u);
  EXPECT_GE(controls["looks"].size(), 8u);
}

TEST(LookVerb, TakesTheNextPortAndEndsAtOnce) {
  Viewer first(small()), second(small());
  EXPECT_NE(first.port(), second.port());
  first.client().Get(first.base().c_str());
  const auto [code, seconds] = first.end();
  EXPECT_EQ(code, 0);
  // 0.2 s are promised; a busy machine gets more.
  EXPECT_LT(seconds, 2);
}

TEST(LookVerb, WritesWhereItIsToldAndNowhereElse) {
  const test::TemporaryFolder folder;
  std::vector<std::string> arguments = small();
  arguments.insert(arguments.end(), {"--folder", folder.file("")});
  const Viewer viewer(arguments);
  const auto job = [&](const std::string& what, const std::string& file) {
    Json body = settings(1);
    body["what"] = what;
    body["file"] = file;
    return viewer.post("job", body);
  };
  for (const char* bad : {"../x.vdb", "/tmp/x.vdb", ".x.vdb", "x.txt", "", "-x.vdb"})
    EXPECT_EQ(job("vdb", bad)->status, 422) << bad;
  const auto all = viewer.messages(
      "a", [&] { EXPECT_EQ(job("exr", "picture.exr")->status, 200); },
      [](const Json& message) { return message["type"] == "job" && message["state"] != "running"; });
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all.back()["state"], "done") << all.back();
  EXPECT_TRUE(std::filesystem::exists(folder.file("picture.exr")));
  EXPECT_EQ(folder.entryCount(), 1u);
}

TEST(LookVerb, GivesTheLookBackAsCommandLinesAndAsAFile) {
  const test::TemporaryFolder folder;
  const Viewer viewer(small());
  const Json body = settings(1, {{"amplitude", "3%"}, {"resolution", "40"}},
                             {{"sun", Json::array({"120,25", "fill=10,10,0.2"})}});
  const Json lines = Json::parse(viewer.post("command", body)->body)["lines"];
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_NE(lines[0].get<std::string>().find("--amplitude=3%"), std::string::npos);
  EXPECT_NE(lines[1].get<std::string>().find("--sun=120,25 --sun=fill=10,10,0.2"), std::string::npos)
      << lines[1];
  const Json recipe = Json::parse(viewer.post("recipe", body)->body);
  std::ofstream(folder.file("look.toml")) << recipe["text"].get<std::string>();
  const auto made = test::runProgram("cloud " + test::ownData("data/cloud_base.obj") + " -o " +
                                     folder.file("a.vdb") + " --config " + folder.file("look.toml"));
  EXPECT_EQ(made.exitCode, 0) << made.errors;
}

TEST(LookVerb, PutsParametersIntoTheirPlaceInAScript) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("s.felt")) << "param float size = 0.5 in [0.1, 2] \"of the ball\";\nscalarfield "
                                          "density = clamp(sphere((0, 0, 0), size) * 20, 0, 1);\n";
  const Viewer viewer({folder.file("s.felt")});
  const Json controls = Json::parse(viewer.client().Get((viewer.base() + "controls").c_str())->body);
  ASSERT_EQ(controls["parameters"].size(), 1u) << controls.dump();
  EXPECT_EQ(controls["parameters"][0]["high"], 2);
  Json body = settings(1);
  body["settings"]["parameters"]["size"] = "0.75";
  const Json recipe = Json::parse(viewer.post("recipe", body)->body);
  EXPECT_NE(recipe["text"].get<std::string>().find("param float size = 0.75 in [0.1, 2]"), std::string::npos)
      << recipe;
  const auto all = viewer.messages(
      "a", [&] { EXPECT_EQ(viewer.post("settings", body)->status, 200); }, isFinal);
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all.back()["type"], "picture") << all.back();
}

TEST(LookVerb, MakesAWedge) {
  const Viewer viewer(small());
  Json body = settings(1);
  body["rows"] = {{"verb", "cloud"}, {"option", "billow"}, {"values", {"0", "1"}}};
  body["columns"] = {{"verb", "render"}, {"option", "exposure"}, {"values", {"0", "1"}}};
  int count = 0;
  viewer.messages(
      "a", [&] { EXPECT_EQ(viewer.post("wedge", body)->status, 200); },
      [&](const Json& message) {
        if (message["type"] == "wedge") {
          EXPECT_EQ(message["payload"], 0xffd8) << message;
        }
        return message["type"] == "wedge" && ++count == 4;
      });
  EXPECT_EQ(count, 4);
  body["rows"]["values"] = std::vector<std::string>(200, "1");
  EXPECT_EQ(viewer.post("wedge", body)->status, 422);
}

TEST(LookVerb, RefusesWhatItCannotLookAt) {
  EXPECT_EQ(test::runProgram("look missing.obj --no-browser").exitCode, 1);
  EXPECT_EQ(test::runProgram("look --no-browser --amplitude=-1").exitCode, 2);
  EXPECT_EQ(test::runProgram("look --no-browser --amplitud=1").exitCode, 2);
  EXPECT_EQ(test::runProgram("look --no-browser --port 0").exitCode, 2);
  EXPECT_EQ(test::runProgram("look --no-browser --folder /nonexistent").exitCode, 1);
}

}  // namespace
}  // namespace nephele
