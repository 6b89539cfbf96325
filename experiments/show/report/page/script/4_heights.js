// Heights over a plane, as colours, on the page of a run and on that of tables: each page has its own `layout`.
const heights = (chart) => [{type: "heatmap", x: chart.x, y: chart.y, z: chart.z, zsmooth: "best", colorscale: "Viridis",
  colorbar: {title: {text: chart.unit}},
  hovertemplate: `${chart.x_axis} %{x}<br>${chart.y_axis} %{y}<br>${chart.unit} %{z}<extra></extra>`}];

function heightsLayout(chart) {
  const base = layout(chart.x_axis, chart.y_axis, {xaxis: {range: [chart.x[0], chart.x.at(-1)]},
                                                   yaxis: {range: [chart.y[0], chart.y.at(-1)]}});
  return {...base, margin: {...base.margin, t: 30, r: 16}, modebar: {...base.modebar, orientation: "h"}};
}
