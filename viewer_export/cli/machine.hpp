// What the files of a machine say that `cie doctor` alone asks.
#pragma once

#include <cie/tracepoints/machine_files.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cie::cli {

class Machine : public MachineFiles {
 public:
  using MachineFiles::MachineFiles;

  // Whether a program of that name is in one of the folders that PATH of this process names.
  bool has_program(const std::string& name) const;

  // Of this process: what /proc/self tells.
  bool is_root() const;
  // Whether the kernel lets it do what that capability is for; unknown counts as no.
  bool has_right(unsigned capability) const;
  // Whether it belongs to the group of that name.
  bool is_in_group(const std::string& name) const;

  // Paths of UNIX sockets that somebody listens on.
  std::vector<std::string> listening_sockets() const;
  // Bytes that can still be written below the folder.
  std::optional<std::uint64_t> free_bytes(const std::filesystem::path& folder) const;
};

}  // namespace cie::cli
