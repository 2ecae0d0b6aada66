#include <cie/viewer_export/instance_writer.hpp>
#include <cie/viewer_export/tables.hpp>

#include "sample_report.hpp"

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <sqlite3.h>

namespace cie::viewer_export {
namespace {

// The first value of the query's answer, as SQL writes it.
std::string answer(const analysis::AnalysisResult& result, const std::string& query) {
  const auto path = std::filesystem::path(testing::TempDir()) / "sqlite_tables_test.db";
  InstanceWriter instances;
  {
    std::ofstream out(path, std::ios::binary);
    write_sqlite(out, result, instances, testing::TempDir());
  }
  sqlite3* opened = nullptr;
  const int code = sqlite3_open(path.c_str(), &opened);
  const std::unique_ptr<sqlite3, decltype(&sqlite3_close)> database(opened, &sqlite3_close);
  EXPECT_EQ(code, SQLITE_OK);
  std::string value;
  const auto keep = [](void* kept, int, char** values, char**) {
    *static_cast<std::string*>(kept) = values[0];
    return 0;
  };
  EXPECT_EQ(sqlite3_exec(opened, query.c_str(), keep, &value, nullptr), SQLITE_OK);
  std::filesystem::remove(path);
  return value;
}

// As in every other format; also where nothing lies behind the text.
TEST(SqliteTables, TellEmptyTextFromUnknown) {
  analysis::AnalysisResult result;
  result.report = test::sample_report();
  result.report.callbacks.resize(1);
  auto& callback = result.report.callbacks[0];
  callback.kind.reset();
  callback.source = "";
  callback.release_source.reset();
  EXPECT_EQ(answer(result,
                   "SELECT quote(kind) || quote(source) || quote(release_source) "
                   "FROM callbacks"),
            "''''NULL");
}

}  // namespace
}  // namespace cie::viewer_export
