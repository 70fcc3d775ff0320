#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace feeler::evaluation {

/// What a page did in headless Chromium.
struct BrowserAnswer {
  nlohmann::json check;               ///< what report_page_check.js found; null if it never answered
  std::vector<std::string> problems;  ///< warnings and errors on the console
};

/// The path of Chromium; empty if it is not installed.
std::string FindChromium();

/// Opens a copy of the page with report_page_check.js at its end, and waits for the answer, at most a minute.
BrowserAnswer OpenPage(const std::string& page_file, const std::string& scratch_folder, int width, int height);

}  // namespace feeler::evaluation
