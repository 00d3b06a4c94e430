// A self-contained HTML page: headings, text, tables, pictures.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace counterpoint::apps {

struct PageTable {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  ///< each as long as the header
};

/// Returns the table in Markdown; cells are not escaped.
std::string markdown_table(const PageTable& table);

/// Builds a page from parts in the order in which they are added. All texts are escaped.
class HtmlPage {
 public:
  explicit HtmlPage(std::string title) : title_(std::move(title)) {}

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  void list(const std::vector<std::string>& items);
  void table(const PageTable& table);
  /// Adds a list of links: a text and a file beside the page, each.
  void links(const std::vector<std::pair<std::string, std::string>>& words_and_files);
  /// Adds a picture made by svg() (chart.h); the page's script lets readers zoom and read values.
  void picture(const std::string& svg);
  /// The same; write_page (recordings/page.h) also writes the picture to a file beside the page.
  void picture_with_file(const std::string& svg);
  /// Pictures that have a file, in the order in which they were added.
  const std::vector<std::string>& files() const { return files_; }

  /// The whole page.
  std::string text() const;

 private:
  std::string title_, body_;
  std::vector<std::string> files_;
  bool has_pictures_ = false;
};

}  // namespace counterpoint::apps
