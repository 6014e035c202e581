// Columns as pixels, one each, north up.
#ifndef VANTAGE_CLIENT_PICTURE_COLUMN_RASTER_H_
#define VANTAGE_CLIENT_PICTURE_COLUMN_RASTER_H_

#include "client/picture/canvas.h"
#include "client/picture/column_map.h"

namespace vantage::picture {

// What has been measured and what is missing.
Raster CoverageRaster(const ColumnMap& map);

// The standing measured surface alone: where the walls are, behind something else.
Raster ContextRaster(const ColumnMap& map);

}  // namespace vantage::picture

#endif  // VANTAGE_CLIENT_PICTURE_COLUMN_RASTER_H_
