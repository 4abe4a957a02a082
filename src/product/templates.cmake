# Embeds examples/templates/NAME.toml as generated/product/template_texts.h.
set(texts "")
foreach(name frame wall hall silo chimney tower)
  set(file ${PROJECT_SOURCE_DIR}/examples/templates/${name}.toml)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(READ ${file} text)
  string(APPEND texts "    {\"${name}\", R\"toml(${text})toml\"},\n")
endforeach()
configure_file(${CMAKE_CURRENT_LIST_DIR}/template_texts.h.in ${CMAKE_BINARY_DIR}/generated/product/template_texts.h @ONLY)
