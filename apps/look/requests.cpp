#include "apps/look/requests.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>

namespace nephele::apps {
namespace {

std::string pageOf(const nlohmann::json& body) {
  return checkedPage(body.value("page", ""));
}

LookShow showOf(const nlohmann::json& body) {
  LookShow show;
  if (!body.contains("show")) return show;
  const auto& given = body["show"];
  if (!given.is_object()) throw LookFault("", "show: must be an object");
  const std::string what = given.value("what", "cloud");
  const auto named = LookShow::named(what);
  if (!named) throw LookFault("", "show: got '" + what + "', which nothing is called");
  show.what = *named;
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

/// Values of one option.
struct WedgeAxis {
  std::string verb, option;
  std::vector<std::string> values;
};

WedgeAxis axisOf(const nlohmann::json& given) {
  if (!given.is_object()) throw LookFault("", "wedge: rows and columns must be objects");
  WedgeAxis axis{given.value("verb", ""), given.value("option", ""), {}};
  if (!emptySettings().contains(axis.verb))
    throw LookFault("", "wedge: got the verb '" + axis.verb + "', which has no settings");
  if (!given.contains("values") || !given["values"].is_array() || given["values"].empty())
    throw LookFault("", "wedge: there must be values");
  for (const auto& value : given["values"]) {
    if (!value.is_string()) throw LookFault("", "wedge: values must be texts");
    axis.values.push_back(value);
  }
  return axis;
}

/// The settings with the value of an axis in them.
LookSettings with(LookSettings settings, const WedgeAxis& axis, const std::string& value) {
  settings[axis.verb][axis.option] = value;
  return settings;
}

}  // namespace

const std::string& checkedPage(const std::string& name) {
  if (name.empty() || name.size() > 32 ||
      !std::ranges::all_of(name, [](unsigned char c) { return std::isalnum(c); }))
    throw LookFault("", "page: must be letters and digits, at most 32");
  return name;
}

void readSize(const nlohmann::json& body, int& width, int& height) {
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

std::shared_ptr<const LookPlan> planOf(const LookSubject& subject, const nlohmann::json& body) {
  return std::make_shared<const LookPlan>(subject, checkedSettings(body.value("settings", nlohmann::json())),
                                          showOf(body).what);
}

LookRequest requestOf(const LookSubject& subject, const nlohmann::json& body) {
  LookRequest request;
  request.page = pageOf(body);
  request.revision = revisionOf(body);
  readSize(body, request.width, request.height);
  request.show = showOf(body);
  request.hurries = body.value("hurry", false);
  request.plan = planOf(subject, body);
  return request;
}

LookWedge wedgeOf(const LookSubject& subject, const nlohmann::json& body) {
  LookWedge wedge;
  wedge.page = pageOf(body);
  wedge.revision = revisionOf(body);
  readSize(body, wedge.width, wedge.height);
  wedge.show = showOf(body);
  const WedgeAxis rows = axisOf(body.value("rows", nlohmann::json()));
  std::optional<WedgeAxis> columns;
  if (body.contains("columns") && !body["columns"].is_null()) columns = axisOf(body["columns"]);
  const std::size_t count = rows.values.size() * (columns ? columns->values.size() : 1);
  if (count > LookWedge::kMostCells)
    throw LookFault("", fmt::format("wedge: {} pictures, at most {}", count, LookWedge::kMostCells));
  const LookSettings settings = checkedSettings(body.value("settings", nlohmann::json()));
  const auto add = [&](const std::string& label, const LookSettings& own) {
    wedge.cells.push_back(
        {label, std::make_shared<const LookPlan>(subject, checkedSettings(own), wedge.show.what)});
  };
  for (const std::string& row : rows.values) {
    const LookSettings inRow = with(settings, rows, row);
    const std::string label = rows.option + "=" + row;
    if (!columns) add(label, inRow);
    if (columns)
      for (const std::string& column : columns->values)
        add(label + " " + columns->option + "=" + column, with(inRow, *columns, column));
  }
  return wedge;
}

}  // namespace nephele::apps
