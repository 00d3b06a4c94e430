#include "html_page.h"

#include "chart.h"
#include "chart_script.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::apps {
namespace {

constexpr const char* kStyle =
    "body{font-family:sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;font-size:13px;margin:1em 0}"
    "th,td{border:1px solid #ddd;padding:3px 8px;text-align:left}"
    "td.number{text-align:right;font-variant-numeric:tabular-nums}"
    "th{background:#f4f4f4}svg{max-width:100%;height:auto}"
    ".values{min-height:1.4em;font-size:12px;font-variant-numeric:tabular-nums}"
    ".values span{margin-right:14px}";

}  // namespace

std::string markdown_table(const PageTable& table) {
  std::string out = "|", rule = "|";
  for (const std::string& cell : table.header) {
    out += " " + cell + " |";
    rule += "---|";
  }
  out += "\n" + rule + "\n";
  for (const auto& row : table.rows) {
    out += "|";
    for (const std::string& cell : row) out += " " + cell + " |";
    out += "\n";
  }
  return out;
}

void HtmlPage::heading(const std::string& text) {
  body_ += "<h2>" + escape_markup(text) + "</h2>\n";
}

void HtmlPage::paragraph(const std::string& text) {
  body_ += "<p>" + escape_markup(text) + "</p>\n";
}

void HtmlPage::list(const std::vector<std::string>& items) {
  if (items.empty()) return;
  body_ += "<ul>\n";
  for (const std::string& item : items) body_ += "<li>" + escape_markup(item) + "</li>\n";
  body_ += "</ul>\n";
}

void HtmlPage::links(const std::vector<std::pair<std::string, std::string>>& words_and_files) {
  body_ += "<ul>\n";
  for (const auto& [words, file] : words_and_files)
    body_ += "<li><a href='" + escape_markup(file) + "'>" + escape_markup(words) + "</a></li>\n";
  body_ += "</ul>\n";
}

void HtmlPage::table(const PageTable& table) {
  body_ += "<table>\n<tr>";
  for (const std::string& cell : table.header) body_ += "<th>" + escape_markup(cell) + "</th>";
  body_ += "</tr>\n";
  for (const auto& row : table.rows) {
    body_ += "<tr>";
    for (const std::string& cell : row) {
      // Numbers are aligned to the right of their column.
      body_ += parse_number(cell) ? "<td class='number'>" : "<td>";
      body_ += escape_markup(cell) + "</td>";
    }
    body_ += "</tr>\n";
  }
  body_ += "</table>\n";
}

void HtmlPage::picture(const std::string& svg) {
  body_ += "<div>" + svg + "</div>\n";
  has_pictures_ = true;
}

void HtmlPage::picture_with_file(const std::string& svg) {
  picture(svg);
  files_.push_back(svg);
}

std::string HtmlPage::text() const {
  const std::string title = escape_markup(title_);
  return "<!DOCTYPE html>\n<html lang='en'>\n<head><meta charset='utf-8'>"
         "<meta name='viewport' content='width=device-width, initial-scale=1'>"
         "<meta http-equiv='Content-Security-Policy' content=\"default-src 'none'; script-src "
         "'unsafe-inline'; style-src 'unsafe-inline'; img-src data:\">"
         "<link rel='icon' href='data:,'><title>" +
         title + "</title><style>" + kStyle + "</style></head>\n<body>\n<h1>" + title + "</h1>\n" +
         body_ + (has_pictures_ ? "<script>" + std::string(chart_script()) + "</script>\n" : "") +
         "</body>\n</html>\n";
}

}  // namespace counterpoint::apps
