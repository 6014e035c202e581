// Columns as pixels, one each, north up.
#ifndef VANTAGE_CLIENT_PICTURE_COLUMN_RASTER_H_
#define VANTAGE_CLIENT_PICTURE_COLUMN_RASTER_H_

#include "client/picture/canvas.h"
#include "client/picture/column_map.h"

namespace vantage::picture {

// The surface that has been measured and that is missing.
Raster CoverageRaster(const ColumnMap& map);

// Only the standing measured surface: the walls, as a background.
Raster ContextRaster(const ColumnMap& map);

}  // namespace vantage::picture

#endif  // VANTAGE_CLIENT_PICTURE_COLUMN_RASTER_H_
