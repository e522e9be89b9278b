#include "apps/look/server.h"

#include <fmt/format.h>
#include <httplib.h>
#include <netinet/in.h>
#include <sys/random.h>
#include <sys/socket.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "apps/look/controls.h"
#include "apps/look/exports.h"
#include "apps/look/page_files.inc"

namespace nephele::apps {
namespace {

// Of requests; pictures go the other way.
constexpr std::size_t kMostBytes = 1 << 20;
constexpr int kMostThreads = 32, kMostPorts = 100, kMostCells = 100;

std::string randomWord() {
  constexpr char kLetters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ012345678901";
  unsigned char bytes[22];
  require(getrandom(bytes, sizeof(bytes), 0) == sizeof(bytes), "no random numbers from the system");
  std::string word;
  for (const unsigned char byte : bytes) word += kLetters[byte & 63];
  return word;
}

bool isPageName(const std::string& text) {
  return !text.empty() && text.size() <= 32 &&
         std::ranges::all_of(text, [](unsigned char c) { return std::isalnum(c); });
}

std::string pageOf(const nlohmann::json& body) {
  const std::string page = body.value("page", "");
  if (!isPageName(page)) throw LookFault("", "page: must be letters and digits, at most 32");
  return page;
}

nlohmann::json errorOf(const std::exception& error) {
  nlohmann::json one = {{"verb", ""}, {"option", ""}, {"message", error.what()}};
  if (const auto* fault = dynamic_cast<const LookFault*>(&error)) {
    one["verb"] = fault->verb();
    one["option"] = fault->option();
  }
  return {{"errors", {one}}};
}

void sizeOf(const nlohmann::json& body, int& width, int& height) {
  if (!body.contains("size")) return;
  const auto& size = body["size"];
  const auto fits = [](const nlohmann::json& n) {
    return n.is_number_integer() && n.get<std::int64_t>() >= 16 && n.get<std::int64_t>() <= 4096;
  };
  if (!size.is_array() || size.size() != 2 || !fits(size[0]) || !fits(size[1]))
    throw LookFault("", "size: must be two whole numbers from 16 to 4096");
  width = size[0];
  height = size[1];
}

LookShow showOf(const nlohmann::json& body) {
  LookShow show;
  if (!body.contains("show")) return show;
  const auto& given = body["show"];
  if (!given.is_object()) throw LookFault("", "show: must be an object");
  const std::string what = given.value("what", "cloud");
  if (what == "surface")
    show.what = LookShow::What::surface;
  else if (what == "checker")
    show.what = LookShow::What::checker;
  else if (what != "cloud")
    throw LookFault("", "show: got '" + what + "', allowed: cloud, surface, checker");
  show.layer = given.value("layer", "beauty");
  const std::set<std::string> known{"beauty", "depth", "normal", "transmittance", "albedo"};
  if (!known.contains(show.layer) && !show.layer.starts_with("light_"))
    throw LookFault("", "layer: got '" + show.layer +
                            "', allowed: beauty, depth, normal, transmittance, albedo, light_NAME");
  show.falseColor = given.value("false_color", false);
  return show;
}

std::int64_t revisionOf(const nlohmann::json& body) {
  return body.contains("revision") && body["revision"].is_number_integer()
             ? body["revision"].get<std::int64_t>()
             : 0;
}

struct Axis {
  std::string verb, option;
  std::vector<std::string> values;
};

Axis axisOf(const nlohmann::json& given) {
  if (!given.is_object()) throw LookFault("", "wedge: rows and columns must be objects");
  Axis axis{given.value("verb", ""), given.value("option", ""), {}};
  if (axis.verb != "cloud" && axis.verb != "render" && axis.verb != "parameters")
    throw LookFault("", "wedge: verb must be cloud, render or parameters");
  if (!given.contains("values") || !given["values"].is_array() || given["values"].empty())
    throw LookFault("", "wedge: there must be values");
  for (const auto& value : given["values"]) {
    if (!value.is_string()) throw LookFault("", "wedge: values must be texts");
    axis.values.push_back(value);
  }
  return axis;
}

/// Ends all connections to a port of this process; the server would wait for them to say something.
void endConnections(int port) {
  constexpr int kMostSockets = 1024;
  for (int socket = 0; socket < kMostSockets; ++socket) {
    sockaddr_storage own{};
    socklen_t size = sizeof(own);
    if (getsockname(socket, reinterpret_cast<sockaddr*>(&own), &size) != 0) continue;
    const in_port_t its = own.ss_family == AF_INET    ? reinterpret_cast<const sockaddr_in&>(own).sin_port
                          : own.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(own).sin6_port
                                                      : in_port_t(0);
    if (ntohs(its) == port) shutdown(socket, SHUT_RDWR);
  }
}

const char* typeOfFile(const std::string& name) {
  if (name.ends_with(".js")) return "text/javascript; charset=utf-8";
  if (name.ends_with(".css")) return "text/css; charset=utf-8";
  if (name.ends_with(".svg")) return "image/svg+xml";
  if (name.ends_with(".jpg")) return "image/jpeg";
  return "text/html; charset=utf-8";
}

}  // namespace

LookServer::LookServer(const LookServerOptions& options)
    : options_(options),
      word_(randomWord()),
      engine_(options.memoryLimitBytes),
      jobs_([this](const nlohmann::json& message) { engine_.tell(message); }),
      server_(std::make_unique<httplib::Server>()) {
  server_->new_task_queue = [] { return new httplib::ThreadPool(kMostThreads); };
  server_->set_payload_max_length(kMostBytes);
  server_->set_read_timeout(5);
  server_->set_write_timeout(10);
  server_->set_keep_alive_timeout(30);
  server_->set_tcp_nodelay(true);
  // Its own choice would let two viewers share a port, and with it each other's pages.
  server_->set_socket_options([](socket_t socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  });
  route();
  for (int i = 0; i < kMostPorts && port_ == 0 && options_.port + i <= 65535; ++i)
    if (server_->bind_to_port(options_.host, options_.port + i)) port_ = options_.port + i;
  if (port_ == 0)
    throw LookFault("", fmt::format("--port: none from {} on is free on {}", options_.port, options_.host));
  const bool isIpv6 = options_.host.find(':') != std::string::npos;
  address_ =
      fmt::format("http://{}:{}/{}/", isIpv6 ? "[" + options_.host + "]" : options_.host, port_, word_);
  thread_ = std::thread([this] { server_->listen_after_bind(); });
}

LookServer::~LookServer() {
  engine_.tell({{"type", "bye"}});
  engine_.closeAll();
  while (!server_->is_running()) std::this_thread::yield();
  server_->stop();
  endConnections(port_);
  thread_.join();
}

bool LookServer::isFromHere(const httplib::Request& request) const {
  std::string host = request.get_header_value("Host");
  // Without its port, which a tunnel may change.
  if (const std::size_t colon = host.rfind(':');
      colon != std::string::npos && host.find(']', colon) == std::string::npos)
    host.resize(colon);
  const bool isKnown = host == "127.0.0.1" || host == "localhost" || host == "[::1]" ||
                       host == options_.host || host == "[" + options_.host + "]";
  if (!isKnown && options_.host != "0.0.0.0" && options_.host != "::") return false;
  const std::string origin = request.get_header_value("Origin");
  return request.method == "GET" || origin.empty() || origin == "http://" + request.get_header_value("Host");
}

void LookServer::route() {
  server_->set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
    response.set_header("X-Content-Type-Options", "nosniff");
    response.set_header("Referrer-Policy", "no-referrer");
    response.set_header("Cache-Control", "no-store");
    response.set_header("Content-Security-Policy",
                        "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src "
                        "'self' blob: data:; "
                        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
    if (isFromHere(request)) return httplib::Server::HandlerResponse::Unhandled;
    response.status = 403;
    response.set_content(
        "{\"errors\":[{\"verb\":\"\",\"option\":\"\",\"message\":\"not from this page\"}]}\n",
        "application/json");
    return httplib::Server::HandlerResponse::Handled;
  });
  server_->set_exception_handler([](const httplib::Request&, httplib::Response& response,
                                    std::exception_ptr) {
    response.status = 500;
    response.set_content(
        "{\"errors\":[{\"verb\":\"\",\"option\":\"\",\"message\":\"the request could not be answered\"}]}\n",
        "application/json");
  });
  const std::string base = "/" + word_ + "/";
  server_->Get(base + "([a-z_]*\\.?[a-z]*)", [this](const httplib::Request& request,
                                                    httplib::Response& response) {
    const std::string name = request.matches[1].length() ? request.matches[1].str() : "index.html";
    if (name == "controls") {
      try {
        response.set_content(controls().dump(), "application/json");
      } catch (const std::exception& error) {
        response.status = 422;
        response.set_content(errorOf(error).dump(), "application/json");
      }
      return;
    }
    if (name == "stream") return stream(request, response);
    if (name == "pixel") {
      const auto number = [&](const char* key) {
        return parseNumber(request.get_param_value(key)).value_or(-1);
      };
      response.set_content(engine_.pixel(request.get_param_value("page"), number("x"), number("y")).dump(),
                           "application/json");
      return;
    }
    for (const PageFile& file : kPageFiles)
      if (file.name == name)
        return response.set_content(file.bytes.data(), file.bytes.size(), typeOfFile(name));
    response.status = 404;
  });
  server_->Get(base + "look/([a-z-]+\\.jpg)",
               [](const httplib::Request& request, httplib::Response& response) {
                 const std::string name = "look/" + request.matches[1].str();
                 for (const PageFile& file : kPageFiles)
                   if (file.name == name)
                     return response.set_content(file.bytes.data(), file.bytes.size(), "image/jpeg");
                 response.status = 404;
               });
  answer("settings", &LookServer::setSettings);
  answer("wedge", &LookServer::makeWedge);
  answer("command", &LookServer::commandLines);
  answer("recipe", &LookServer::recipe);
  answer("save-look", &LookServer::saveLook);
  answer("job", &LookServer::startJob);
  answer("stop", &LookServer::stopJob);
}

void LookServer::answer(const std::string& name, Handler handler) {
  server_->Post("/" + word_ + "/" + name,
                [this, handler](const httplib::Request& request, httplib::Response& response) {
                  nlohmann::json result;
                  try {
                    const nlohmann::json body = nlohmann::json::parse(request.body, nullptr, false);
                    if (!body.is_object()) throw LookFault("", "the body must be a JSON object");
                    result = (this->*handler)(body);
                  } catch (const nlohmann::json::exception&) {
                    response.status = 400;
                    result = errorOf(LookFault("", "the body has values of other types than it should"));
                  } catch (const std::exception& error) {
                    response.status = 422;
                    result = errorOf(error);
                  }
                  response.set_content(result.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace),
                                       "application/json");
                });
}

void LookServer::stream(const httplib::Request& request, httplib::Response& response) {
  const std::string name = request.get_param_value("page");
  const std::shared_ptr<LookPage> page = isPageName(name) ? engine_.open(name) : nullptr;
  if (!page) {
    response.status = 429;
    return response.set_content(
        errorOf(Error(fmt::format("at most {} pages at once", LookEngine::kMostPages))).dump(),
        "application/json");
  }
  constexpr double kHeartbeat = 5;
  response.set_chunked_content_provider(
      "application/octet-stream",
      [page](std::size_t, httplib::DataSink& sink) {
        std::string bytes;
        if (!page->next(bytes, kHeartbeat)) {
          sink.done();
          return true;
        }
        return sink.write(bytes.data(), bytes.size());
      },
      [this, name, page](bool) { engine_.close(name, page); });
}

nlohmann::json LookServer::controls() const {
  const LookSubject& subject = options_.subject;
  return {{"version", options_.version},
          {"input",
           {{"name", subject.path.empty() ? "a cloud of its own" : subject.path}, {"kind", subject.word()}}},
          {"has_cloud", subject.hasCloud()},
          {"settings", options_.settings},
          {"groups", lookControls(subject)},
          {"parameters", lookParameters(subject)},
          {"looks", shippedLooks(subject)},
          {"saved", savedLooks()}};
}

std::shared_ptr<const LookPlan> LookServer::planOf(const nlohmann::json& body) const {
  return std::make_shared<const LookPlan>(options_.subject,
                                          checkedSettings(body.value("settings", nlohmann::json())));
}

nlohmann::json LookServer::setSettings(const nlohmann::json& body) {
  LookRequest request;
  request.page = pageOf(body);
  request.revision = revisionOf(body);
  sizeOf(body, request.width, request.height);
  request.show = showOf(body);
  request.hurries = body.value("hurry", false);
  request.plan = planOf(body);
  {
    const std::lock_guard lock(mutex_);
    if (latest_.size() > 4 * LookEngine::kMostPages) latest_.clear();
    latest_[request.page] = request;
  }
  const std::int64_t revision = request.revision;
  engine_.ask(std::move(request));
  return {{"revision", revision}};
}

nlohmann::json LookServer::makeWedge(const nlohmann::json& body) {
  LookWedge wedge;
  wedge.page = pageOf(body);
  wedge.revision = revisionOf(body);
  sizeOf(body, wedge.width, wedge.height);
  wedge.show = showOf(body);
  const Axis rows = axisOf(body.value("rows", nlohmann::json()));
  std::optional<Axis> columns;
  if (body.contains("columns") && !body["columns"].is_null()) columns = axisOf(body["columns"]);
  const std::size_t count = rows.values.size() * (columns ? columns->values.size() : 1);
  if (count > std::size_t(kMostCells))
    throw LookFault("", fmt::format("wedge: {} pictures, at most {}", count, kMostCells));
  const LookSettings settings = checkedSettings(body.value("settings", nlohmann::json()));
  for (const std::string& row : rows.values)
    for (std::size_t c = 0; c < (columns ? columns->values.size() : 1); ++c) {
      LookSettings own = settings;
      own[rows.verb][rows.option] = row;
      std::string label = rows.option + "=" + row;
      if (columns) {
        own[columns->verb][columns->option] = columns->values[c];
        label += " " + columns->option + "=" + columns->values[c];
      }
      wedge.cells.push_back(
          {label, std::make_shared<const LookPlan>(options_.subject, checkedSettings(own))});
    }
  engine_.ask(std::move(wedge));
  return {{"count", count}};
}

nlohmann::json LookServer::commandLines(const nlohmann::json& body) {
  LookExports exports{options_.subject, planOf(body)->settings};
  sizeOf(body, exports.width, exports.height);
  return {{"lines", exports.typed()}};
}

nlohmann::json LookServer::recipe(const nlohmann::json& body) {
  const LookExports exports{options_.subject, planOf(body)->settings};
  if (options_.subject.kind == LookSubject::Kind::script)
    return {{"name", std::filesystem::path(options_.subject.path).filename().string()},
            {"text", exports.script()}};
  return {{"name", "cloud.toml"}, {"text", exports.recipe()}};
}

nlohmann::json LookServer::saveLook(const nlohmann::json& body) {
  apps::saveLook(body.value("name", ""), planOf(body)->settings);
  return {{"saved", savedLooks()}};
}

nlohmann::json LookServer::startJob(const nlohmann::json& body) {
  LookExports exports{options_.subject, planOf(body)->settings};
  sizeOf(body, exports.width, exports.height);
  const std::string what = body.value("what", ""), file = body.value("file", "");
  const auto within = [&](const std::string& name) {
    return (std::filesystem::path(options_.folder) / name).string();
  };
  const bool grows = options_.subject.hasCloud();
  std::vector<std::vector<std::string>> lines;
  std::vector<std::string> temporary;
  std::string volume = within("." + randomWord() + ".vdb");
  if (what == "vdb") {
    if (!grows) throw LookFault("", "vdb: what is looked at is a volume already");
    lines.push_back(exports.cloudLine(within(plainFileName(file, {".vdb"}))));
  } else if (what == "exr" || what == "png" || what == "turntable") {
    const bool isTurn = what == "turntable";
    const std::string path = within(plainFileName(file, what == "png" ? std::vector<std::string>{".png"}
                                                        : isTurn      ? std::vector<std::string>{".mp4"}
                                                                      : std::vector<std::string>{".exr"}));
    if (grows) {
      lines.push_back(exports.cloudLine(volume));
      temporary.push_back(volume);
    }
    std::vector<std::string> line = exports.pictureLine(isTurn ? "turntable" : "render", volume);
    line.insert(line.end(), {what == "png" ? "--preview" : isTurn ? "--movie" : "-o", path});
    if (isTurn) line.insert(line.end(), {"--frames", body.value("frames", "1-48")});
    lines.push_back(line);
  } else {
    throw LookFault("", "what: got '" + what + "', allowed: exr, png, vdb, turntable");
  }
  return {{"id", jobs_.start(what, std::move(lines), std::move(temporary))}};
}

nlohmann::json LookServer::stopJob(const nlohmann::json& body) {
  return {{"stopped", jobs_.stop(body.value("id", 0))}};
}

std::vector<std::string> LookServer::watched() const {
  std::vector<std::string> files;
  if (!options_.subject.path.empty()) files.push_back(options_.subject.path);
  for (const char* name : {"recipe", "texture"})
    for (const char* verb : {"cloud", "render"})
      if (options_.settings[verb].contains(name))
        files.push_back(options_.settings[verb][name].get<std::string>());
  return files;
}

void LookServer::changed(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    const bool isGone = fileStamp(path).empty();
    nlohmann::json message = {
        {"type", "file"}, {"path", path}, {"state", isGone ? "gone" : "changed"}, {"message", ""}};
    if (isGone) message["message"] = path + ": there is no such file now";
    try {
      if (!isGone && path == options_.subject.path) lookParameters(options_.subject);
    } catch (const std::exception& error) {
      message["state"] = "bad";
      message["message"] = error.what();
    }
    engine_.tell(message);
    if (message["state"] != "changed") return;
  }
  std::vector<LookRequest> again;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [page, request] : latest_) again.push_back(request);
  }
  for (LookRequest& request : again) try {
      request.hurries = false;
      request.plan = std::make_shared<const LookPlan>(options_.subject, request.plan->settings);
      engine_.ask(std::move(request));
    } catch (const std::exception& error) {
      engine_.tell({{"type", "file"}, {"path", paths.front()}, {"state", "bad"}, {"message", error.what()}});
    }
}

}  // namespace nephele::apps
