// A self-contained HTML page: headings, text, tables, pictures.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace counterpoint::apps {

struct PageTable {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  ///< as long as the header each
};

/// The table in Markdown; cells are taken as they are.
std::string markdown_table(const PageTable& table);

/// Collects what is to be shown, in the order in which it is added. All texts are escaped.
class HtmlPage {
 public:
  explicit HtmlPage(std::string title) : title_(std::move(title)) {}

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  void list(const std::vector<std::string>& items);
  void table(const PageTable& table);
  /// A list of words that lead to files beside the page.
  void links(const std::vector<std::pair<std::string, std::string>>& words_and_files);
  /// A picture as svg (chart.h) gives it; one can zoom into it and read values off it.
  void picture(const std::string& svg);

  /// The whole page.
  std::string text() const;

 private:
  std::string title_, body_;
  bool has_pictures_ = false;
};

}  // namespace counterpoint::apps
