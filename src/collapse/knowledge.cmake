# Embeds data/knowledge.json as generated/collapse/knowledge_data.h.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/data/knowledge.json)
file(READ ${PROJECT_SOURCE_DIR}/data/knowledge.json TOPPLE_KNOWLEDGE)
configure_file(${CMAKE_CURRENT_LIST_DIR}/knowledge_data.h.in ${CMAKE_BINARY_DIR}/generated/collapse/knowledge_data.h @ONLY)
