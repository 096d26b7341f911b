// Lines of a TUM text file: stamps, numbers and names, with the line at fault in every error.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tum {

// A row of a file: its words, and where it stands.
struct Row {
    std::size_t line;  // counted from 1
    std::vector<std::string> words;
};

// Rows of a file. Empty lines and those that begin with # are left out.
std::vector<Row> read_rows(const std::string &path);

// Nanoseconds of decimal seconds, from the text itself: a double would lose 238 ns at today's epoch.
std::int64_t stamp_ns(const std::string &path, const Row &row, const std::string &seconds);

// A finite number.
double number(const std::string &path, const Row &row, const std::string &text);

// "path:line: what", to be thrown.
std::string at_line(const std::string &path, const Row &row, const std::string &what);

bool is_file(const std::string &path);

}  // namespace tum
