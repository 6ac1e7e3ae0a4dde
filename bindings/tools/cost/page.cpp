#include "study.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "chart.h"
#include "file.h"
#include "messages.h"
#include "report.h"

namespace cli::cost {
namespace {

constexpr char kStyle[] = R"(
body { font: 15px/1.5 system-ui, sans-serif; color: #21262e; margin: 2em auto;
  max-width: 1100px; padding: 0 1em; }
h1 { font-size: 1.5em; }
h2 { font-size: 1.15em; margin-top: 2em; }
table { border-collapse: collapse; }
td, th { padding: .25em .9em .25em 0; text-align: left; vertical-align: top; }
th { border-bottom: 1px solid #aaa; font-weight: 600; }
td.n { text-align: right; font-variant-numeric: tabular-nums; }
.pick { background: #fdf0ee; }
.warn { background: #fff6dc; padding: .6em 1em; border-left: 4px solid #e0a800; }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(320px, 1fr)); gap: 1em; }
figure { margin: 0; }
figure img { width: 100%; border: 1px solid #ddd; }
figure.pick img { border: 3px solid #cc4033; }
figcaption { font-size: .9em; }
pre { background: #f4f5f7; padding: .8em 1em; white-space: pre-wrap; overflow-wrap: anywhere; }
svg { width: 100%; height: auto; }
)";

std::string base64(const std::string &bytes) {
  static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k) word = word << 8 | (i + k < bytes.size() ? uint8_t(bytes[i + k]) : 0);
    for (size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? digits[word >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

std::string figure_3(double x) { return std::isfinite(x) ? formatted("%.3g", x) : "-"; }

std::string cells(const std::string &label, double error, const Row &row) {
  return "<td class=\"n\">" + percent(error) + "</td><td class=\"n\">" + figure_3(row.cpu_per_s) +
         (row.alone ? "" : "~") + "</td><td>" + escaped(label) + "</td></tr>\n";
}

std::string front_table(const Study &study) {
  std::string out =
      std::string("<table><tr><th></th><th>error</th><th>") + study.cost_unit + "</th><th>choice</th></tr>\n";
  for (size_t k = 0; k < study.front.size(); ++k) {
    const size_t i = study.front[k];
    out += std::string("<tr") + (int(i) == study.pick ? " class=\"pick\"" : "") + "><td class=\"n\">" +
           std::to_string(k + 1) + "</td>" +
           cells(study.rows[i].job.label, study.rows[i].headline, study.rows[i]);
  }
  if (study.rows[0].compared)
    out += "<tr><td></td>" + cells("the scene as it is", study.rows[0].headline, study.rows[0]);
  return out + "</table>\n";
}

std::string own_mesh(const Study &study) {
  const OnThisMesh &own = study.own_mesh;
  if (own.reference < 0) return "";
  std::string out = "<h2>On this mesh: model and step alone</h2>\n<p>" + escaped(mesh_text(study)) +
                    "</p>\n<table><tr><th>error</th><th>" + study.cost_unit + "</th><th>choice</th></tr>\n";
  for (const size_t i : own.front)
    out += std::string("<tr") + (int(i) == study.pick ? " class=\"pick\"" : "") + ">" +
           cells(study.rows[i].job.label, own.error.at(i), study.rows[i]);
  return out + "</table>\n";
}

std::string pictures(const Study &study) {
  std::vector<std::pair<size_t, std::string>> shown;
  shown.emplace_back(size_t(study.reference), "the reference");
  shown.emplace_back(0, "the scene as it is");
  for (size_t k = 0; k < study.front.size(); ++k)
    if (study.front[k] != 0) shown.emplace_back(study.front[k], "front " + std::to_string(k + 1));
  const auto listed = [&](size_t i) {
    return std::ranges::any_of(shown, [&](const auto &one) { return one.first == i; });
  };
  for (const size_t i : study.own_mesh.front)
    if (!listed(i)) shown.emplace_back(i, "on this mesh");
  // times taken alone may have moved a member off its front
  for (size_t i = 0; i < study.rows.size(); ++i)
    if (!study.rows[i].picture.empty() && !listed(i)) shown.emplace_back(i, "beside the front");
  std::string out;
  for (const auto &[i, what] : shown) {
    const Row &row = study.rows[i];
    if (row.picture.empty() || (i == size_t(study.reference) && what != "the reference")) continue;
    const bool own = i == 0 || row.job.label == what;
    out += std::string("<figure") + (int(i) == study.pick ? " class=\"pick\"" : "") +
           "><img alt=\"the scene at its end\" src=\"data:image/png;base64," +
           base64(read_file(row.picture, 64u << 20, "a picture")) + "\"><figcaption><b>" + what +
           "</b>: " + (own ? "" : escaped(row.job.label) + ", ") +
           (int(i) == study.reference ? "" : percent(row.headline) + ", ") + figure_3(row.cpu_per_s) + " " +
           study.cost_unit + "</figcaption></figure>\n";
  }
  if (out.empty()) return "";
  return "<h2>Side by side, at the end of the scene</h2>\n<div class=\"pictures\">\n" + out + "</div>\n";
}

std::string separated(const Study &study) {
  std::string out =
      "<h2>One change at a time</h2>\n<p>From the scene as it is; each axis against its own finest choice, "
      "so that errors of time, space, model and contact do not mix.</p>\n";
  for (const Separated &part : study.separated) {
    out += "<h3>" + part.axis + "</h3>\n<p>against " + escaped(study.rows[part.anchor].job.label) +
           "</p>\n<table><tr><th>difference</th><th>" + study.cost_unit + "</th><th>choice</th></tr>\n";
    for (const auto &[i, e] : part.rows)
      if (i != part.anchor) out += "<tr>" + cells(study.rows[i].job.label, e, study.rows[i]);
    out += "</table>\n";
  }
  std::string left;
  for (const Axis &axis : study.axes.axes)
    if (!axis.left_out.empty()) left += "<li>" + axis.name + ": " + escaped(axis.left_out) + "</li>\n";
  return out + (left.empty() ? "" : "<p>Left out:</p><ul>\n" + left + "</ul>\n");
}

std::string not_run(const Subject &subject, const Study &study) {
  std::string out;
  for (const std::string &line : left_out(subject, study)) out += "<li>" + escaped(line) + "</li>\n";
  return out.empty() ? "" : "<h2>Not compared</h2>\n<ul>\n" + out + "</ul>\n";
}

}  // namespace

std::string escaped(const std::string &text) {
  std::string out;
  for (const char c : text) {
    if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '&') out += "&amp;";
    else if (c == '"') out += "&quot;";
    else out += c;
  }
  return out;
}

std::string page_html(const Subject &subject, const Study &study) {
  const std::string name = escaped(subject.path.substr(subject.path.rfind('/') + 1));
  std::string of;
  for (const std::string &q : study.headline) of += (of.empty() ? "" : ", ") + escaped(q);
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width\"><title>What accuracy costs: " +
         name + "</title><style>" + kStyle + "</style></head>\n<body>\n<h1>What accuracy costs: " + name +
         "</h1>\n<p>Error of " + of +
         (subject.at_rest
              ? ": difference from the reference at the end, relative to how far the reference moves. "
                "Cost: seconds of processor time; ~ while other runs ran beside.</p>\n<p"
              : ": root mean square over time of the difference from the reference, relative to how "
                "far the reference moves. Cost: seconds of processor time for a simulated second; ~ while "
                "other runs ran beside.</p>\n"
                "<p") +
         (study.converged ? "" : " class=\"warn\"") + ">" + escaped(reference_text(study)) + "</p>\n" +
         svg_chart(subject, study) + "<h2>What to take</h2>\n<pre>" + escaped(pick_text(subject, study)) +
         "</pre>\n" + "<h2>The front: nothing cheaper is as accurate</h2>\n" + front_table(study) +
         own_mesh(study) + pictures(study) + separated(study) + not_run(subject, study) + "</body></html>\n";
}

}  // namespace cli::cost
