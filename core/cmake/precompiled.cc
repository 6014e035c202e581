// A target needs a source: room.cmake says what is precompiled.
