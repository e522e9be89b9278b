// The viewer through its protocol, as a page speaks it; and what is no page.
#include <gtest/gtest.h>
#include <httplib.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "nephele/render/image/exr_io.h"
#include "tests/support/run_program.h"

namespace nephele {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

/// A viewer that runs for as long as this.
class Viewer {
 public:
  /// `opens`: a folder with a program xdg-open, by which it opens a browser.
  explicit Viewer(std::vector<std::string> arguments, const std::string& opens = {}) {
    int ends[2];
    if (pipe(ends) != 0) std::abort();
    arguments.insert(arguments.begin(), {"nephele", "look"});
    arguments.insert(arguments.end(), {"--port", "8300"});
    if (opens.empty()) arguments.push_back("--no-browser");
    std::vector<char*> words;
    const std::string program = test::programPath();
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    process_ = fork();
    if (process_ == 0) {
      if (!opens.empty()) {
        setenv("DISPLAY", ":0", 1);
        setenv("PATH", (opens + ":/usr/bin:/bin").c_str(), 1);
      }
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
  pid_t process() const { return process_; }
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
  const auto nested = [](const char* inner) {
    return "{\"settings\": " + std::string(200000, '[') + inner + std::string(200000, ']') + "}";
  };
  for (const std::string& deep : {nested(""), nested("1"), "{\"rows\": " + std::string(400000, '[')})
    for (const char* name : {"command", "wedge"}) {
      const auto answer = client.Post((viewer.base() + name).c_str(), deep, "application/json");
      ASSERT_TRUE(answer) << viewer.ending();
      EXPECT_EQ(answer->status, 422);
      EXPECT_NE(answer->body.find("nests more than 32 deep"), std::string::npos) << answer->body;
    }
  const auto nameless = client.Get((viewer.base() + "stream?page=a/b").c_str());
  EXPECT_EQ(nameless->status, 422);
  EXPECT_NE(nameless->body.find("page: must be letters and digits"), std::string::npos) << nameless->body;
  EXPECT_EQ(viewer.ending(), "");
}

TEST(LookVerb, TakesSettingsThatCommandLinesTake) {
  const Viewer viewer(small());
  const std::pair<Json, Json> cases[]{{{{"-o", "x"}}, Json::object()},
                                      {{{"help", true}}, Json::object()},
                                      {Json::object(), {{"help-all", true}}},
                                      {Json::object(), {{"size", "4x4"}}},
                                      {Json::object(), {{"config", "x.toml"}}}};
  for (const auto& [cloud, render] : cases) {
    const auto answer = viewer.post("settings", settings(1, cloud, render));
    EXPECT_EQ(answer->status, 422) << cloud << render;
    EXPECT_EQ(answer->body.find("called with"), std::string::npos) << answer->body;
  }
  Json body = settings(1);
  body["settings"]["parameters"] = {{"size", "1"}};
  EXPECT_EQ(viewer.post("settings", body)->status, 422) << "there is no script";
  Json light = settings(1);
  light["show"] = {{"what", "cloud"}, {"layer", "light_nix"}};
  const auto all = viewer.messages(
      "a", [&] { EXPECT_EQ(viewer.post("settings", light)->status, 200); }, isFinal);
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all.back()["message"], "layer: got 'light_nix', and no light has this name");
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

/// Children of a process that have ended, and that it has not waited for.
int unreapedChildren(pid_t parent) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(entry.path() / "stat");
    std::string line;
    if (!std::getline(file, line)) continue;
    std::istringstream words(line.substr(line.rfind(')') + 1));
    char state = 0;
    pid_t its = 0;
    words >> state >> its;
    count += its == parent && state == 'Z';
  }
  return count;
}

TEST(LookVerb, WaitsForTheBrowserThatItHasOpened) {
  const test::TemporaryFolder folder;
  const std::string opened = folder.file("opened");
  std::ofstream(folder.file("xdg-open")) << "#!/bin/sh\necho \"$1\" > " << opened << "\n";
  std::filesystem::permissions(folder.file("xdg-open"), std::filesystem::perms::owner_all);
  const Viewer viewer(small(), folder.file(""));
  for (int i = 0; i != 500 && test::textOf(opened).empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_NE(test::textOf(opened).find(viewer.base()), std::string::npos);
  EXPECT_EQ(viewer.client().Get((viewer.base() + "controls").c_str())->status, 200);
  EXPECT_EQ(unreapedChildren(viewer.process()), 0);
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
  EXPECT_TRUE(readImage(folder.file("picture.exr")).find("backdrop.R"));
  EXPECT_EQ(folder.entryCount(), 1u);
}

/// How a job ends that `viewer` is asked for.
Json endOfJob(const Viewer& viewer, const std::string& what, const std::string& file, Json body) {
  body["what"] = what;
  body["file"] = file;
  const auto all = viewer.messages(
      "a", [&] { EXPECT_EQ(viewer.post("job", body)->status, 200); },
      [](const Json& message) { return message["type"] == "job" && message["state"] != "running"; });
  return all.empty() ? Json() : all.back();
}

TEST(LookVerb, SaysWhyAnExportFailed) {
  const test::TemporaryFolder folder;
  std::vector<std::string> arguments = small();
  arguments.insert(arguments.end(), {"--folder", folder.file("")});
  const Viewer viewer(arguments);
  // Of use, and followed by a hint.
  const Json narrow =
      endOfJob(viewer, "exr", "a.exr", settings(1, Json::object(), {{"orthographic-width", "4"}}));
  EXPECT_EQ(narrow["state"], "failed");
  EXPECT_EQ(narrow["message"], "--orthographic-width: is for --projection orthographic alone");
  std::filesystem::create_directory(folder.file("a.vdb"));
  const Json blocked = endOfJob(viewer, "vdb", "a.vdb", settings(1));
  EXPECT_EQ(blocked["state"], "failed");
  EXPECT_EQ(blocked["message"], "cannot write " + folder.file("a.vdb") + ": it is a folder");
}

TEST(LookVerb, KeepsWhatItLooksAt) {
  const test::TemporaryFolder folder;
  const std::string input = folder.file("a.vdb");
  ASSERT_EQ(
      test::runProgram("levelset " + test::ownData("data/sphere_uv.obj") + " --resolution 12 -o " + input)
          .exitCode,
      0);
  const std::string before = test::textOf(input);
  const Viewer viewer({input, "--resolution", "12", "--layers", "0", "--folder", folder.file("")});
  Json body = settings(1, {{"resolution", "12"}, {"layers", "0"}});
  body.update({{"what", "vdb"}, {"file", "a.vdb"}});
  const auto answer = viewer.post("job", body);
  EXPECT_EQ(answer->status, 422);
  EXPECT_NE(answer->body.find("'a.vdb' is what is looked at"), std::string::npos) << answer->body;
  EXPECT_EQ(endOfJob(viewer, "vdb", "b.vdb", body)["state"], "done");
  EXPECT_EQ(test::textOf(input), before);
}

TEST(LookVerb, WritesWholePicturesAndTurntables) {
  const test::TemporaryFolder folder;
  std::vector<std::string> arguments = small();
  arguments.insert(arguments.end(), {"--quality", "draft", "--folder", folder.file("")});
  const Viewer viewer(arguments);
  EXPECT_EQ(endOfJob(viewer, "png", "picture.png", settings(1))["state"], "done");
  const std::string png = test::textOf(folder.file("picture.png"));
  EXPECT_TRUE(png.starts_with("\x89PNG"));
  // Its last chunk, without content, and the check sum of that.
  EXPECT_TRUE(png.ends_with(std::string("\0\0\0\0IEND\xae\x42\x60\x82", 12)));
  Json turn = settings(1);
  turn["frames"] = "1-3";
  const Json end = endOfJob(viewer, "turntable", "turn.mp4", turn);
  if (std::system("command -v ffmpeg > /dev/null") != 0) {
    EXPECT_EQ(end["state"], "failed");
    EXPECT_EQ(folder.entryCount(), 1u);
    return;
  }
  EXPECT_EQ(end["state"], "done") << end;
  // The index comes last in a movie: without it nothing can be played.
  const std::string movie = test::textOf(folder.file("turn.mp4"));
  EXPECT_NE(movie.find("ftyp"), std::string::npos);
  EXPECT_NE(movie.find("moov"), std::string::npos);
  EXPECT_EQ(folder.entryCount(), 2u);
}

TEST(LookVerb, StopsAJobAtOnceAndLeavesNothingOfIt) {
  const test::TemporaryFolder folder;
  const Viewer viewer(
      {test::ownData("data/cloud_base.obj"), "--resolution", "160", "--folder", folder.file("")});
  for (const auto& [what, file] :
       {std::pair{"exr", "a.exr"}, {"png", "a.png"}, {"turntable", "a.mp4"}, {"vdb", "a.vdb"}}) {
    Json body = settings(1, {{"resolution", "160"}});
    body["size"] = {640, 360};
    body["what"] = what;
    body["file"] = file;
    Clock::time_point asked;
    bool isAsked = false;
    const auto all = viewer.messages(
        "a", [&] { EXPECT_EQ(viewer.post("job", body)->status, 200); },
        [&](const Json& message) {
          if (message["type"] != "job") return false;
          // Once it has begun to work.
          if (message["state"] == "running" && message["fraction"] > 0 && !isAsked) {
            asked = Clock::now();
            isAsked = true;
            EXPECT_EQ(viewer.post("stop", {{"id", message["id"]}})->body, "{\"stopped\":true}");
          }
          return message["state"] != "running";
        });
    ASSERT_FALSE(all.empty());
    EXPECT_EQ(all.back()["state"], "stopped") << all.back();
    // 0.2 s are promised; a busy machine gets more.
    EXPECT_LT(std::chrono::duration<double>(Clock::now() - asked).count(), 0.5) << what;
    EXPECT_EQ(folder.entryCount(), 0u) << what;
  }
}

/// The last picture of the first view of a viewer, and what came before.
Json pictureOf(const Viewer& viewer, Json body) {
  const auto all = viewer.messages(
      "a", [&] { EXPECT_EQ(viewer.post("settings", body)->status, 200); }, isFinal);
  return all.empty() ? Json({{"type", "nothing"}}) : all.back();
}

Json shown(Json body, const std::string& what) {
  body["show"] = {{"what", what}};
  return body;
}

TEST(LookVerb, SamplesAScriptForTheCameraThatRests) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("s.felt")) << "scalarfield density = clamp(sphere((0, 0, 0), 1) * 20, 0, 1);\n"
                                          "vector sun = (0, 80, 3);\n";
  const Viewer viewer({folder.file("s.felt"), "--quality", "draft"});
  const auto from = [](int revision, const std::string& z) {
    return settings(revision, Json::object(),
                    {{"quality", "draft"}, {"camera-position", "0,0," + z}, {"look-at", "0,0,0"}});
  };
  const Json far = pictureOf(viewer, from(1, "12"));
  ASSERT_EQ(far["type"], "picture") << far;
  // What the script says of the picture, as `render` takes it.
  EXPECT_NEAR(far["sun"][1].get<double>(), 80, 1e-3);
  // Where it is dragged, the voxels stay.
  Json dragged = from(2, "4");
  dragged["hurry"] = true;
  const auto all = viewer.messages(
      "a", [&] { EXPECT_EQ(viewer.post("settings", dragged)->status, 200); },
      [](const Json& message) { return message["type"] == "picture" || message["type"] == "error"; });
  ASSERT_EQ(all.back()["type"], "picture") << all.back();
  EXPECT_EQ(all.back()["voxels"], far["voxels"]);
  // A third of the distance to the middle, and a quarter and less to the nearest of it.
  const Json near = pictureOf(viewer, from(3, "4"));
  ASSERT_EQ(near["type"], "picture") << near;
  EXPECT_GT(near["voxels"].get<double>(), 2.5 * far["voxels"].get<double>());
  // As finely as `render` does.
  const auto rendered =
      test::runProgram("render " + folder.file("s.felt") +
                       " --camera-position=0,0,4 --look-at=0,0,0 --size 64x36 --quality draft "
                       "--preview " +
                       folder.file("x.png") + " --stats " + folder.file("x.json"));
  ASSERT_EQ(rendered.exitCode, 0) << rendered.errors;
  const double voxel = Json::parse(test::textOf(folder.file("x.json")))["script"]["voxel_size"];
  const double side = near["bounds"][1][0].get<double>() - near["bounds"][0][0].get<double>();
  EXPECT_NEAR(side / voxel, near["voxels"].get<double>(), 1e-3 * side / voxel);
}

TEST(LookVerb, ShowsAllOfAVolume) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("v.vdb");
  ASSERT_EQ(test::runProgram("cloud " + test::ownData("data/cloud_base.obj") +
                             " --resolution 48 --layers 1 -o " + file)
                .exitCode,
            0);
  const Viewer viewer({file});
  const Json beauty = pictureOf(viewer, settings(1));
  ASSERT_EQ(beauty["type"], "picture") << beauty;
  // These need more of the file than its light does.
  Json normal = settings(2);
  normal["show"] = {{"what", "cloud"}, {"layer", "normal"}};
  EXPECT_EQ(pictureOf(viewer, normal)["type"], "picture");
  const Json point = pictureOf(viewer, settings(3, Json::object(), {{"point", Json::array({"0,3,0,2"})}}));
  EXPECT_EQ(point["type"], "picture") << point;
  // Another sun on the same ground, and a lamp that has moved.
  for (const char* sun : {"10,20", "60,30"}) {
    const Json ground =
        pictureOf(viewer, settings(3, Json::object(), {{"ground", true}, {"sun", Json::array({sun})}}));
    EXPECT_EQ(ground["type"], "picture") << ground;
  }
  const Json moved = pictureOf(viewer, settings(3, Json::object(), {{"point", Json::array({"0,4,0,2"})}}));
  EXPECT_EQ(moved["type"], "picture") << moved;
  const Json surface = pictureOf(viewer, shown(settings(4), "surface"));
  ASSERT_EQ(surface["type"], "picture") << surface;
  for (int axis = 0; axis != 3; ++axis) {
    const auto side = [&](const Json& of) {
      return of["bounds"][1][axis].get<double>() - of["bounds"][0][axis].get<double>();
    };
    EXPECT_GT(side(surface), 0.85 * side(beauty)) << axis;
  }
}

TEST(LookVerb, ShowsThePiecesOfACut) {
  const test::TemporaryFolder folder;
  const Viewer viewer({test::ownData("data/cloud_base.obj"), "--show", "pieces", "--plane=0,0.5,0,0,1,0",
                       "--folder", folder.file("")});
  const Json controls = Json::parse(viewer.client().Get((viewer.base() + "controls").c_str())->body);
  EXPECT_EQ(controls["show"], "pieces");
  EXPECT_EQ(controls["settings"]["cut"]["plane"], Json::array({"0,0.5,0,0,1,0"}));
  Json body = shown(settings(1), "pieces");
  body["settings"]["cut"] = controls["settings"]["cut"];
  body["settings"]["cut"]["explode"] = "0";
  const Json together = pictureOf(viewer, body);
  ASSERT_EQ(together["type"], "picture") << together;
  body["revision"] = 2;
  body["settings"]["cut"]["explode"] = "1";
  const Json apart = pictureOf(viewer, body);
  ASSERT_EQ(apart["type"], "picture") << apart;
  // Both halves go up and down, and what is at rest keeps its box.
  const auto height = [](const Json& picture) {
    return picture["bounds"][1][1].get<double>() - picture["bounds"][0][1].get<double>();
  };
  EXPECT_GT(height(apart), 1.2 * height(together));
  body["settings"]["cut"]["plane"] = Json::array({"0,1"});
  EXPECT_EQ(viewer.post("settings", body)->status, 422);
  body["settings"]["cut"] = {{"output", folder.file("x")}};
  EXPECT_EQ(viewer.post("settings", body)->status, 422);
  // Without a knife it is one piece.
  body["settings"]["cut"] = Json::object();
  body["revision"] = 3;
  EXPECT_EQ(pictureOf(viewer, body)["type"], "picture");
  body["settings"]["cut"] = {{"plane", Json::array({"0,0.5,0,0,1,0"})}};
  const Json lines = Json::parse(viewer.post("command", body)->body)["lines"];
  EXPECT_NE(lines[0].get<std::string>().find("nephele cut"), std::string::npos);
  EXPECT_EQ(endOfJob(viewer, "pieces", "pieces", body)["state"], "done");
  EXPECT_TRUE(std::filesystem::exists(folder.file("pieces/piece_0002.obj")));
  EXPECT_EQ(folder.entryCount(), 1u);
}

TEST(LookVerb, ShowsWhatIsCarriedFromOneMeshToAnother) {
  const test::TemporaryFolder folder;
  const Viewer viewer({test::ownData("data/sphere_uv.obj"), test::ownData("data/cloud_base.obj"), "--quality",
                       "fast", "--folder", folder.file("")});
  const Json controls = Json::parse(viewer.client().Get((viewer.base() + "controls").c_str())->body);
  EXPECT_EQ(controls["show"], "transfer");
  EXPECT_EQ(controls["settings"]["transfer"]["quality"], "fast");
  Json body = shown(settings(1), "transfer");
  body["settings"]["transfer"] = controls["settings"]["transfer"];
  const Json picture = pictureOf(viewer, body);
  ASSERT_EQ(picture["type"], "picture") << picture;
  EXPECT_EQ(picture["turns"], true);
  // Both stand on the ground, each at most one unit long, the gap between them over the origin.
  EXPECT_NEAR(picture["bounds"][0][1].get<double>(), 0, 1e-5);
  EXPECT_LE(picture["bounds"][1][1].get<double>(), 1.001);
  body["settings"]["transfer"]["preview-paint"] = "distortion";
  body["revision"] = 2;
  EXPECT_EQ(pictureOf(viewer, body)["type"], "picture");
  EXPECT_EQ(endOfJob(viewer, "mesh", "object.obj", body)["state"], "done");
  EXPECT_NE(test::textOf(folder.file("object.obj")).find("\nvt "), std::string::npos);
  EXPECT_EQ(viewer.post("settings", shown(settings(3), "nothing"))->status, 422);
}

TEST(LookVerb, ShowsWispsByTheirLook) {
  const Viewer viewer({"--look", "wisps", "--dots", "2000", "--resolution", "40"});
  const Json controls = Json::parse(viewer.client().Get((viewer.base() + "controls").c_str())->body);
  EXPECT_EQ(controls["show"], "wisps");
  EXPECT_EQ(controls["settings"]["wisps"]["dots"], "2000");
  EXPECT_EQ(controls["settings"]["render"]["phase"], "mie:8");
  std::map<std::string, Json> looks;
  for (const Json& look : controls["looks"]) looks[look["name"]] = look;
  for (const char* name :
       {"humilis", "congestus", "storm", "wisps", "silver-lining", "sunset", "smoke", "explosion"}) {
    EXPECT_EQ(looks.count(name), 1u) << name;
    EXPECT_EQ(viewer.client().Get((viewer.base() + "look/" + name + ".jpg").c_str())->status, 200) << name;
  }
  EXPECT_EQ(looks["wisps"]["show"], "wisps");
  EXPECT_EQ(looks["wisps"]["settings"]["wisps"]["dots"], "2000000");
  Json body = shown(settings(1), "wisps");
  body["settings"]["wisps"] = controls["settings"]["wisps"];
  const Json picture = pictureOf(viewer, body);
  ASSERT_EQ(picture["type"], "picture") << picture;
  EXPECT_GT(picture["voxels"], 20);
  // And back: steps of the one are not taken for those of the other.
  EXPECT_EQ(pictureOf(viewer, settings(2, {{"resolution", "32"}, {"layers", "1"}}))["type"], "picture");
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

TEST(LookVerb, GivesBackACloudOfItsOwn) {
  const test::TemporaryFolder folder;
  const Viewer viewer({"--resolution", "24", "--layers", "1"});
  const Json body = settings(1, {{"resolution", "24"}, {"layers", "1"}}, {{"backdrop", false}});
  const std::string text = Json::parse(viewer.post("recipe", body)->body)["text"];
  EXPECT_NE(text.find("species = \"mediocris\"\n"), std::string::npos) << text;
  EXPECT_NE(text.find("backdrop = false\n"), std::string::npos) << text;
  std::ofstream(folder.file("look.toml")) << text;
  const auto made =
      test::runProgram("cloud -o " + folder.file("a.vdb") + " --config " + folder.file("look.toml"));
  EXPECT_EQ(made.exitCode, 0) << made.errors;
}

TEST(LookVerb, PutsParametersIntoTheirPlaceInAScript) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.file("s.felt"))
      << "// To try: param float size = 2 is large.\n"
         "/* param float size = 3; */ param float size = 0.5 in [0.1, 2] \"of the "
         "ball\";\n"
         "param string kind = \"perlin\" in [\"perlin\", \"worley\"];\n"
         "scalarfield density = clamp((sphere((0, 0, 0), size) + 0.1 * "
         "noise(kind, frequency = 3)) * 20, 0, 1);\n";
  const Viewer viewer({folder.file("s.felt")});
  const Json controls = Json::parse(viewer.client().Get((viewer.base() + "controls").c_str())->body);
  ASSERT_EQ(controls["parameters"].size(), 2u) << controls.dump();
  EXPECT_EQ(controls["parameters"][0]["high"], 2);
  Json body = settings(1);
  body["settings"]["parameters"] = {{"size", "0.75"}, {"kind", "worley"}};
  const Json recipe = Json::parse(viewer.post("recipe", body)->body);
  EXPECT_NE(recipe["text"].get<std::string>().find("param string kind = \"worley\" in"), std::string::npos)
      << recipe;
  EXPECT_EQ(recipe["text"].get<std::string>().find(
                "// To try: param float size = 2 is large.\n/* param float size = 3; "
                "*/ param float size = 0.75 in [0.1, 2]"),
            0u)
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
  const auto flag = test::runProgram("look --no-browser --half=false");
  EXPECT_EQ(flag.exitCode, 2);
  EXPECT_NE(flag.errors.find("--half: got 'false', allowed: no value; it is a flag"), std::string::npos)
      << flag.errors;
  const auto host = test::runProgram("look --no-browser --host nowhere.invalid");
  EXPECT_EQ(host.exitCode, 1);
  EXPECT_NE(host.errors.find("--host: got 'nowhere.invalid'"), std::string::npos) << host.errors;
  EXPECT_EQ(test::runProgram("look --no-browser --folder /nonexistent").exitCode, 1);
  const std::string mesh = test::ownData("data/cloud_base.obj");
  EXPECT_EQ(test::runProgram("look --no-browser --show pieces").exitCode, 2);
  EXPECT_EQ(test::runProgram("look " + mesh + " --no-browser --show transfer").exitCode, 2);
  EXPECT_EQ(test::runProgram("look " + mesh + " --no-browser --show pieces --amplitude 1%").exitCode, 2);
  EXPECT_EQ(test::runProgram("look " + mesh + " missing.obj --no-browser").exitCode, 1);
}

}  // namespace
}  // namespace nephele
