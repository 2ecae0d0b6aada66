#include <cie/tracepoints/utf8.hpp>
#include <cie/viewer_export/output_file.hpp>
#include <cie/viewer_export/tables.hpp>

#include "base/file_descriptor.hpp"
#include "instance_rows.hpp"
#include "output/held_signals.hpp"
#include "output/spool.hpp"
#include "output/write_all.hpp"
#include "result_tables.hpp"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

namespace cie::viewer_export {
namespace {

struct Close {
  void operator()(sqlite3* database) const noexcept { sqlite3_close_v2(database); }
};
struct Finalize {
  void operator()(sqlite3_stmt* statement) const noexcept { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

std::string_view type_name(ColumnType type) {
  switch (type) {
    case ColumnType::integer:
      return "INTEGER";
    case ColumnType::boolean:
      return "BOOLEAN";  // 0 and 1, by a name that other readers know
    case ColumnType::real:
      return "REAL";
    case ColumnType::text:
      break;
  }
  return "TEXT";
}

// A database in a file that has a name only while it is opened.
class Database {
 public:
  explicit Database(const std::filesystem::path& directory)
      : object_("the database, " + temporary_data(directory)) {
    std::error_code error;
    const auto place = std::filesystem::canonical(temporary_place(directory), error);
    if (error) throw_write_error("cannot create " + object_, error.value());
    const HeldSignals held;  // until it has no name
    std::string name = (place / "cie-XXXXXX").string();
    file_ = FileDescriptor(::mkostemp(name.data(), O_CLOEXEC));
    if (!file_.is_open()) throw_write_error("cannot create " + object_, errno);
    sqlite3* database = nullptr;
    const int result = sqlite3_open_v2(
        name.c_str(), &database, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_NOFOLLOW,
        nullptr);
    database_.reset(database);
    if (result == SQLITE_OK) {
      // Nobody else opens it, and what fails is thrown away.
      run("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA locking_mode = EXCLUSIVE; "
          "BEGIN EXCLUSIVE");
    }
    ::unlink(name.c_str());
    if (result != SQLITE_OK) fail("cannot open ");
  }

  void run(const std::string& sql) {
    if (sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
      fail("cannot write ");
  }

  Statement prepare(const std::string& sql) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK)
      fail("cannot write ");
    return Statement(statement);
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw WriteError(what + object_ + ": " + sqlite3_errmsg(database_.get()));
  }

  // Closes it and copies its bytes.
  void copy_to(std::ostream& out) {
    run("COMMIT");
    database_.reset();
    std::array<char, 65536> part{};
    off_t at = 0;
    while (true) {
      const ssize_t size = ::pread(file_.get(), part.data(), part.size(), at);
      if (size < 0) throw_write_error("cannot read back " + object_, errno);
      if (size == 0) return;
      out.write(part.data(), size);
      at += size;
    }
  }

 private:
  std::string object_;  // for messages
  FileDescriptor file_;
  std::unique_ptr<sqlite3, Close> database_;
};

class SqliteTable final : public TableWriter {
 public:
  SqliteTable(Database& database, std::string_view name, std::span<const Column> columns)
      : database_(database) {
    std::string described;
    std::string places;
    for (const Column& column : columns) {
      described += fmt::format("{}\"{}\" {}", described.empty() ? "" : ", ", column.name,
                               type_name(column.type));
      places += places.empty() ? "?" : ", ?";
    }
    database_.run(fmt::format("CREATE TABLE \"{}\" ({})", name, described));
    insert_ = database_.prepare(fmt::format("INSERT INTO \"{}\" VALUES ({})", name, places));
  }

  void row(std::span<const Cell> cells) override {
    for (std::size_t i = 0; i < cells.size(); ++i)
      bind(static_cast<int>(i + 1), cells[i]);
    if (sqlite3_step(insert_.get()) != SQLITE_DONE) database_.fail("cannot write ");
    sqlite3_reset(insert_.get());
  }

  void finish() override {}

 private:
  void bind(int place, const Cell& cell) {
    if (const auto* integer = std::get_if<std::int64_t>(&cell)) {
      sqlite3_bind_int64(insert_.get(), place, *integer);
    } else if (const auto* natural = std::get_if<std::uint64_t>(&cell)) {
      sqlite3_bind_int64(insert_.get(), place, static_cast<std::int64_t>(*natural));
    } else if (const auto* real = std::get_if<double>(&cell)) {
      sqlite3_bind_double(insert_.get(), place, *real);
    } else if (const auto* boolean = std::get_if<bool>(&cell)) {
      sqlite3_bind_int(insert_.get(), place, *boolean ? 1 : 0);
    } else if (const auto* text = std::get_if<std::string_view>(&cell)) {
      // The row is inserted before its text is gone.
      const bool is_plain = is_ascii(*text);
      const std::string valid = is_plain ? std::string() : valid_utf8(*text);
      const std::string_view bound = is_plain ? *text : valid;
      // A null pointer, which an empty view may have, would be NULL.
      sqlite3_bind_text(insert_.get(), place, bound.empty() ? "" : bound.data(),
                        static_cast<int>(bound.size()),
                        is_plain ? SQLITE_STATIC : SQLITE_TRANSIENT);
    } else {
      sqlite3_bind_null(insert_.get(), place);
    }
  }

  Database& database_;
  Statement insert_;
};

}  // namespace

void write_sqlite(std::ostream& out, const analysis::AnalysisResult& result,
                  InstanceWriter& instances, const std::filesystem::path& directory) {
  Database database(directory);
  {
    SqliteTable table(database, "instances", InstanceRows::columns());
    InstanceRows::drain(instances, table, result.report);
  }
  for (const ResultTable& described : result_tables()) {
    SqliteTable table(database, described.name, described.columns);
    described.rows(result.report, result.verdicts,
                   [&table](std::span<const Cell> cells, const auto&) { table.row(cells); });
  }
  database.copy_to(out);
}

}  // namespace cie::viewer_export
