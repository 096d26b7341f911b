#include "text_file.hpp"

#include <sys/stat.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <locale>
#include <sstream>

#include "vice_plugin.hpp"

namespace tum {

std::string at_line(const std::string &path, const Row &row, const std::string &what) {
    return path + ":" + std::to_string(row.line) + ": " + what;
}

bool is_file(const std::string &path) {
    struct stat status {};
    return stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode);
}

std::vector<Row> read_rows(const std::string &path) {
    std::ifstream file(path);
    if (!file) throw vice::Error(path + ": cannot be read");
    std::vector<Row> rows;
    std::string line;
    for (std::size_t at = 1; std::getline(file, line); ++at) {
        std::istringstream words(line);
        Row row{at, {}};
        for (std::string word; words >> word;) row.words.push_back(word);
        if (!row.words.empty() && row.words.front().front() != '#') rows.push_back(std::move(row));
    }
    if (file.bad()) throw vice::Error(path + ": cannot be read to its end");
    return rows;
}

std::int64_t stamp_ns(const std::string &path, const Row &row, const std::string &seconds) {
    const auto refuse = [&] {
        return vice::Error(at_line(path, row, "`" + seconds + "` is no stamp in seconds, such as 1305031102.175304"));
    };
    const std::size_t dot = seconds.find('.');
    std::string digits = seconds.substr(0, dot);
    std::string fraction = dot == std::string::npos ? "" : seconds.substr(dot + 1);
    // What is finer than a nanosecond is cut off.
    fraction.resize(9, '0');
    digits += fraction;
    constexpr std::int64_t MAX_NS = std::numeric_limits<std::int64_t>::max();
    if (digits.size() == 9) throw refuse();
    std::int64_t nanos = 0;
    for (const char c : digits) {
        if (c < '0' || c > '9' || nanos > (MAX_NS - (c - '0')) / 10) throw refuse();
        nanos = nanos * 10 + (c - '0');
    }
    return nanos;
}

double number(const std::string &path, const Row &row, const std::string &text) {
    // Not strtod: it takes the decimal comma of the user's locale.
    std::istringstream stream(text);
    stream.imbue(std::locale::classic());
    double value = 0;
    if (!(stream >> value) || !(stream >> std::ws).eof() || !std::isfinite(value))
        throw vice::Error(at_line(path, row, "`" + text + "` is no finite number"));
    return value;
}

}  // namespace tum
