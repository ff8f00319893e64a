// The table that a run writes, read by code of this folder's own.
#pragma once

#include "surface_file.h"

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace splitcubes::torture {

class MetricsTable {
  public:
    /// Throws std::runtime_error where the text is no table with the columns that the laws need.
    explicit MetricsTable(const std::string& text);

    bool has(const std::string& column) const { return columns_.count(column) > 0; }
    std::size_t size() const { return rows_.size(); }
    double at(std::size_t row, const std::string& column) const { return rows_[row][index_of(column)]; }
    /// NAME_x, NAME_y and NAME_z.
    Vec3 vector(std::size_t row, const std::string& name) const {
        return {at(row, name + "_x"), at(row, name + "_y"), at(row, name + "_z")};
    }
    const std::string& flags(std::size_t row) const { return flags_[row]; }
    bool finite(std::size_t row) const;

  private:
    std::size_t index_of(const std::string& column) const;

    std::map<std::string, std::size_t> columns_;
    std::vector<std::vector<double>> rows_;
    std::vector<std::string> flags_;
};

/// Throws std::runtime_error for what is no such file.
MetricsTable read_metrics(const std::filesystem::path& file);

}  // namespace splitcubes::torture
