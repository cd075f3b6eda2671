"""Swagger UI, folded at first, with a search over names, paths and descriptions of operations."""

import json
from html import escape
from string import Template

from starlette.responses import HTMLResponse

_PAGE = Template("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="stylesheet" href="$assets/swagger-ui.css">
<link rel="icon" href="$assets/favicon.png">
<title>$title</title>
</head>
<body>
<div id="swagger-ui"></div>
<script src="$assets/swagger-ui-bundle.js"></script>
<script>
const told = ({path, method, operation}) => [method, path, operation.get("operationId"),
  operation.get("summary"), operation.get("description"), operation.get("x-code")].join(" ").toLowerCase();
const has = (text, words) => words.every((word) => text.includes(word));
const opsFilter = (tags, sought) => {
  const words = sought.toLowerCase().split(/\\s+/);
  return tags
    .map((tag, name) => has(name, words) ? tag
      : tag.update("operations", (all) => all.filter((it) => has(told(it.toObject()), words))))
    .filter((tag) => tag.get("operations").size);
};
SwaggerUIBundle({
  url: $url,
  dom_id: "#swagger-ui",
  deepLinking: true,
  docExpansion: "none",
  defaultModelsExpandDepth: 0,
  filter: true,
  plugins: [() => ({fn: {opsFilter}})],
});
</script>
</body>
</html>
""")


def swagger_page(title: str, url: str, assets: str) -> HTMLResponse:
    """Show the OpenAPI document at a URL; the scripts and styles stand under `assets`."""
    quoted = json.dumps(url).replace("<", r"\u003c")
    return HTMLResponse(_PAGE.substitute(title=escape(title), url=quoted, assets=escape(assets)))
