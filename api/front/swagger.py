"""Swagger UI, folded at first, with a search over names, paths and descriptions of operations; and ReDoc."""

import json
from collections.abc import Iterable
from html import escape
from string import Template
from typing import Final, NamedTuple

from starlette.responses import HTMLResponse

TITLE: Final = "motion-gateway"
_PAGE = Template("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="stylesheet" href="$assets/swagger-ui.css">
<link rel="icon" href="$assets/favicon.png">
<style>
nav { font: 14px sans-serif; max-width: 1460px; margin: auto; padding: 20px 20px 0; }
nav a { margin-right: 20px; }
nav a[aria-current] { color: inherit; font-weight: bold; text-decoration: none; }
</style>
<title>$title</title>
</head>
<body>
<nav aria-label="Documents">$links</nav>
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
// Swagger UI reads the whole document anew for whatever is opened: give it what that leads to.
const SCHEMAS = "#/components/schemas/";
const reached = (document, part, schemas = {}) => {
  if (part === null || typeof part !== "object") return schemas;
  const name = String(part["$$ref"]).split(SCHEMAS)[1];
  if (name && !(name in schemas)) {
    reached(document, schemas[name] = document.components.schemas[name], schemas);
  }
  for (const inner of Object.values(part)) reached(document, inner, schemas);
  return schemas;
};
const partOf = (document, [area, name, schema]) => {
  const paths = area === "paths" ? {[name]: document.paths[name]} : {};
  const models = name === "schemas" && (schema ? {"$$ref": SCHEMAS + schema} : document.components.schemas);
  const schemas = reached(document, [paths, models]);
  return {...document, paths, components: {...document.components, schemas}};
};
const lean = ({fn: {resolveSubtree}}) => ({fn: {opsFilter, resolveSubtree: (document, at, options) =>
  resolveSubtree(partOf(document, at), at, options)}});
SwaggerUIBundle({
  url: $url,
  dom_id: "#swagger-ui",
  deepLinking: true,
  docExpansion: "none",
  defaultModelsExpandDepth: 0,
  filter: true,
  plugins: [lean],
  // What the console keeps of the session of this browser; without it a key is needed.
  requestInterceptor: (request) => {
    const proof = localStorage.getItem("motion-gateway.proof." + location.origin + $root);
    if (proof !== null && new URL(request.url, location.href).origin === location.origin) {
      request.headers["Session-Proof"] = proof;
    }
    return request;
  },
});
</script>
</body>
</html>
""")


_REDOC: Final = Template("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="$assets/favicon.png">
<style>body { margin: 0; padding: 0; }</style>
<title>$title</title>
</head>
<body>
<noscript>ReDoc needs JavaScript.</noscript>
<redoc spec-url="$url"></redoc>
<script src="$assets/redoc.standalone.js"></script>
</body>
</html>
""")


class DocumentPage(NamedTuple):
    """A page of the documentation: its path, its name, and the document that it shows."""

    at: str
    name: str
    document: str


def swagger_page(
    shown: DocumentPage, pages: Iterable[DocumentPage], root_path: str, assets: str
) -> HTMLResponse:
    """Show one page, with links to all; the scripts and styles stand under `assets`."""
    return HTMLResponse(
        _PAGE.substitute(
            title=escape(f"{TITLE}: {shown.name}"),
            links="".join(_link(root_path, page, current=page is shown) for page in pages),
            root=_script(root_path),
            url=_script(root_path + shown.document),
            assets=escape(root_path + assets),
        )
    )


def redoc_page(url: str, assets: str) -> HTMLResponse:
    """Show the whole document as one page."""
    told = {"title": f"{TITLE} - ReDoc", "url": url, "assets": assets}
    return HTMLResponse(_REDOC.substitute({name: escape(text) for name, text in told.items()}))


def _script(text: str) -> str:
    return json.dumps(text).replace("<", r"\u003c")


def _link(root_path: str, page: DocumentPage, *, current: bool) -> str:
    mark = ' aria-current="page"' if current else ""
    return f'<a href="{escape(root_path + page.at)}"{mark}>{escape(page.name)}</a>'
